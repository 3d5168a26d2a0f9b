// A calibration by Ceres, two ways: a residual block per view with derivatives by hand, and a block per point with
// automatic derivatives, as robot_cal_tools poses it. X and Y are a rotation vector and a translation each.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;
using Row4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using Rows6 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;

Matrix3 Skew(const Vector3& v) {
  Matrix3 s;
  s << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return s;
}

Matrix3 Exp(const Vector3& w) {
  const double angle = w.norm();
  return angle < 1e-12 ? Matrix3(Matrix3::Identity() + Skew(w))
                       : Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

Matrix3 LeftJacobian(const Vector3& w) {
  const double a = w.norm();
  const Matrix3 s = Skew(w);
  if (a < 1e-6) return Matrix3::Identity() + 0.5 * s;
  return Matrix3::Identity() + (1 - std::cos(a)) / (a * a) * s + (a - std::sin(a)) / (a * a * a) * s * s;
}

class View final : public ceres::CostFunction {
 public:
  View(const double* camera, const double* points, const double* motion, const double* pixels, int count)
      : camera_(camera), points_(points), pixels_(pixels), count_(count) {
    const Eigen::Map<const Row4> a(motion);
    turn_ = a.topLeftCorner<3, 3>();
    shift_ = a.topRightCorner<3, 1>();
    set_num_residuals(2 * count);
    *mutable_parameter_block_sizes() = {6, 6};
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Vector3> wx(parameters[0]), tx(parameters[0] + 3);
    const Eigen::Map<const Vector3> wy(parameters[1]), ty(parameters[1] + 3);
    const Matrix3 rx = Exp(wx), ry = Exp(wy), rxa = rx * turn_, rxay = rxa * ry;
    const Vector3 shift = rx * (turn_ * ty + shift_) + tx;
    double* jx = jacobians == nullptr ? nullptr : jacobians[0];
    double* jy = jacobians == nullptr ? nullptr : jacobians[1];
    const Matrix3 left = LeftJacobian(wx), right = LeftJacobian(-wy);
    for (int i = 0; i < count_; ++i) {
      const Eigen::Map<const Vector3> point(points_ + 3 * i);
      const Vector3 p = rxay * point + shift;
      const double inverse = 1 / p.z(), x = p.x() * inverse, y = p.y() * inverse;
      residuals[2 * i] = camera_[0] * x + camera_[2] - pixels_[2 * i];
      residuals[2 * i + 1] = camera_[1] * y + camera_[3] - pixels_[2 * i + 1];
      if (jx == nullptr && jy == nullptr) continue;
      Eigen::Matrix<double, 2, 3> g;
      g << camera_[0] * inverse, 0, -camera_[0] * x * inverse, 0, camera_[1] * inverse, -camera_[1] * y * inverse;
      if (jx != nullptr) {
        Eigen::Map<Rows6> j(jx + 12 * i);
        j.leftCols<3>() = g * Skew(tx - p) * left;
        j.rightCols<3>() = g;
      }
      if (jy != nullptr) {
        // d(R p)/dw = -R [p]x J_r(w), and the right Jacobian of SO(3) is the left one of the negative vector.
        Eigen::Map<Rows6> j(jy + 12 * i);
        j.leftCols<3>() = g * rxay * Skew(-point) * right;
        j.rightCols<3>() = g * rxa;
      }
    }
    return true;
  }

 private:
  const double *camera_, *points_, *pixels_;
  int count_;
  Matrix3 turn_;
  Vector3 shift_;
};

template <typename T>
void Move(const T* pose, const T* point, T* moved) {
  ceres::AngleAxisRotatePoint(pose, point, moved);
  for (int i = 0; i < 3; ++i) moved[i] += pose[3 + i];
}

struct Point {
  const double *camera, *point, *motion, *pixel;

  template <typename T>
  bool operator()(const T* x, const T* y, T* residual) const {
    const T p[3] = {T(point[0]), T(point[1]), T(point[2])};
    const T a[6] = {T(motion[0]), T(motion[1]), T(motion[2]), T(motion[3]), T(motion[4]), T(motion[5])};
    T base[3], flange[3], seen[3];
    Move(y, p, base);
    Move(a, base, flange);
    Move(x, flange, seen);
    residual[0] = camera[0] * seen[0] / seen[2] + camera[2] - pixel[0];
    residual[1] = camera[1] * seen[1] / seen[2] + camera[3] - pixel[1];
    return true;
  }
};

}  // namespace

extern "C" int solve(int views, int points, int mode, const double* camera, const double* board,
                     const double* motions, const double* pixels, double* values) {
  ceres::Problem problem;
  double *x = values, *y = values + 6;
  std::vector<double> poses(6 * views);
  for (int k = 0; k < views; ++k) {
    const double* seen = pixels + 2 * points * k;
    if (mode == 0) {
      problem.AddResidualBlock(new View(camera, board, motions + 16 * k, seen, points), nullptr, x, y);
      continue;
    }
    const Eigen::Map<const Row4> a(motions + 16 * k);
    const Eigen::AngleAxisd turn(Matrix3(a.topLeftCorner<3, 3>()));
    Eigen::Map<Vector3>(poses.data() + 6 * k) = turn.angle() * turn.axis();
    Eigen::Map<Vector3>(poses.data() + 6 * k + 3) = a.topRightCorner<3, 1>();
    for (int i = 0; i < points; ++i) {
      auto* cost = new ceres::AutoDiffCostFunction<Point, 2, 6, 6>(
          new Point{camera, board + 3 * i, poses.data() + 6 * k, seen + 2 * i});
      problem.AddResidualBlock(cost, nullptr, x, y);
    }
  }
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 150;
  options.num_threads = 1;
  if (mode == 0) options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (mode == 1) {
    ceres::Covariance::Options how;
    how.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance covariance(how);
    const std::vector<std::pair<const double*, const double*>> blocks = {{x, x}, {x, y}, {y, y}};
    if (!covariance.Compute(blocks, &problem)) return -1;
    double block[36];
    for (const auto& [a, b] : blocks) covariance.GetCovarianceBlock(a, b, block);
  }
  return summary.IsSolutionUsable() ? static_cast<int>(summary.iterations.size()) : -1;
}
