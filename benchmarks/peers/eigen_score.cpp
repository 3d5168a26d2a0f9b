// What candidate views gain, 1/2 ln |L + J'J| - 1/2 ln |L|, with Eigen: a Jacobian of all points per candidate, and the
// determinant of the 12 x 12 sum by LLT or LDLT.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;
using Row4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 12>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Matrix3 Skew(const Vector3& v) {
  Matrix3 s;
  s << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return s;
}

double LogDeterminant(const Matrix12& m) {
  const Eigen::LLT<Matrix12> factor(m);
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += std::log(factor.matrixLLT()(i, i));
  return 2 * sum;
}

double LogDeterminantByLdlt(const Matrix12& m) {
  const Eigen::LDLT<Matrix12> factor(m);
  double sum = 0;
  for (int i = 0; i < 12; ++i) sum += std::log(factor.vectorD()(i));
  return sum;
}

}  // namespace

extern "C" void score(int candidates, int points, int mode, double sigma, const double* camera, const double* board,
                      const double* x, const double* y, const double* information, const double* motions,
                      double* gains) {
  const Row4 X = Eigen::Map<const Row4>(x), Y = Eigen::Map<const Row4>(y);
  const Matrix12 start = Eigen::Map<const Matrix12>(information);
  const double before = LogDeterminant(start), fx = camera[0] / sigma, fy = camera[1] / sigma;
  Rows j(2 * points, 12);
  Matrix6 adjoint = Matrix6::Zero();
  for (int n = 0; n < candidates; ++n) {
    const Row4 xa = X * Eigen::Map<const Row4>(motions + 16 * n);
    const Row4 pose = xa * Y;
    const Matrix3 turn = pose.topLeftCorner<3, 3>(), r = xa.topLeftCorner<3, 3>();
    const Vector3 shift = pose.topRightCorner<3, 1>();
    adjoint.topLeftCorner<3, 3>() = r;
    adjoint.bottomRightCorner<3, 3>() = r;
    adjoint.topRightCorner<3, 3>() = Skew(xa.topRightCorner<3, 1>()) * r;
    for (int i = 0; i < points; ++i) {
      const Vector3 p = turn * Eigen::Map<const Vector3>(board + 3 * i) + shift;
      const double inverse = 1 / p.z(), u = p.x() * inverse, v = p.y() * inverse;
      // d(pixel) = G [I, -[p]x] d(twist), the twist of X on the left: translation first.
      j.row(2 * i).head<6>() << fx * inverse, 0, -fx * u * inverse, -fx * u * v, fx * (1 + u * u), -fx * v;
      j.row(2 * i + 1).head<6>() << 0, fy * inverse, -fy * v * inverse, -fy * (1 + v * v), fy * u * v, fy * u;
    }
    j.rightCols<6>().noalias() = j.leftCols<6>().lazyProduct(adjoint);
    Matrix12 sum = start;
    if (mode == 0) {
      sum.selfadjointView<Eigen::Lower>().rankUpdate(j.transpose());
      gains[n] = 0.5 * (LogDeterminant(sum) - before);
    } else {
      sum.noalias() += j.transpose() * j;
      gains[n] = 0.5 * (LogDeterminantByLdlt(sum) - before);
    }
  }
}
