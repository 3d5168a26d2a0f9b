//! Against formulas written independently, differences on the manifold, and round trips.

use nalgebra::{Matrix4, SVector, Vector3, Vector6};

use super::*;
use crate::se3::Se3;
use crate::simd::VectorUnit;
use crate::testing::{Random, numerical_jacobian};

const UR5E: [[f64; 3]; 6] = [
    // a, d, alpha in quarter turns
    [0.0, 0.1625, 1.0],
    [-0.425, 0.0, 0.0],
    [-0.3922, 0.0, 0.0],
    [0.0, 0.1333, 1.0],
    [0.0, 0.0997, -1.0],
    [0.0, 0.0996, 0.0],
];

/// `Tz(d) Tx(a) Rx(alpha)`: what follows a joint in the standard Denavit-Hartenberg notation.
fn after(row: &[f64; 3]) -> Se3 {
    let turn = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, row[2] * std::f64::consts::FRAC_PI_2, 0.0, 0.0));
    Se3::new(turn.rotation, Vector3::new(row[0], 0.0, row[1]))
}

fn ur5e() -> Chain {
    let mut placement = Se3::identity();
    let mut joints = Vec::new();
    for row in &UR5E {
        let limit = std::f64::consts::TAU;
        let kind = JointKind::Revolute;
        joints.push(Joint { kind, placement, axis: Vector3::z(), lower: -limit, upper: limit });
        placement = after(row);
    }
    Chain::new(joints, placement).unwrap()
}

/// Any placements and axes, sliding joints among them.
fn random_chain(random: &mut Random, count: usize) -> Chain {
    let joints = (0..count)
        .map(|i| Joint {
            kind: if i % 3 == 2 { JointKind::Prismatic } else { JointKind::Revolute },
            placement: random.transform(0.4, 2.0),
            axis: match i % 4 {
                0 => Vector3::z(),
                1 => -Vector3::y(),
                _ => Vector3::new(random.normal(), random.normal(), random.normal()),
            },
            lower: -2.5,
            upper: 2.5,
        })
        .collect();
    Chain::new(joints, random.transform(0.2, 2.0)).unwrap()
}

fn posture(random: &mut Random, chain: &Chain) -> Vec<f64> {
    chain.joints().iter().map(|j| random.uniform(j.lower.max(-3.0), j.upper.min(3.0))).collect()
}

/// Placements and exponentials multiplied out, as the documentation of the room says.
fn product(chain: &Chain, q: &[f64]) -> Se3 {
    let mut t = Se3::identity();
    for (joint, q) in chain.joints().iter().zip(q) {
        let motion = match joint.kind {
            JointKind::Revolute => Vector6::new(0.0, 0.0, 0.0, joint.axis.x, joint.axis.y, joint.axis.z),
            JointKind::Prismatic => Vector6::new(joint.axis.x, joint.axis.y, joint.axis.z, 0.0, 0.0, 0.0),
        };
        t = t * joint.placement * Se3::exp(&(motion * *q));
    }
    t * *chain.tip()
}

#[test]
fn flange_of_a_ur5e_is_where_the_notation_puts_it() {
    let chain = ur5e();
    let mut random = Random::new(1);
    for _ in 0..100 {
        let q = posture(&mut random, &chain);
        let mut expected = Matrix4::<f64>::identity();
        for (row, q) in UR5E.iter().zip(&q) {
            let (s, c) = q.sin_cos();
            let (sa, ca) = (row[2] * std::f64::consts::FRAC_PI_2).sin_cos();
            #[rustfmt::skip]
            let link = Matrix4::new(
                c, -s * ca,  s * sa, row[0] * c,
                s,  c * ca, -c * sa, row[0] * s,
                0.0,    sa,      ca, row[1],
                0.0,   0.0,     0.0, 1.0,
            );
            expected *= link;
        }
        assert!((chain.forward(&q).to_matrix() - expected).amax() < 1e-14);
    }
}

#[test]
fn any_chain_is_the_product_of_its_placements_and_motions() {
    let mut random = Random::new(2);
    for count in [1, 2, 3, 6, 7, MAX_JOINTS] {
        for _ in 0..20 {
            let chain = random_chain(&mut random, count);
            let q = posture(&mut random, &chain);
            let difference = chain.forward(&q).to_matrix() - product(&chain, &q).to_matrix();
            assert!(difference.amax() < 1e-12 * count as f64, "{count}: {difference}");
        }
    }
}

#[test]
fn jacobians_are_derivatives_on_the_manifold() {
    let mut random = Random::new(3);
    for _ in 0..30 {
        let chain = random_chain(&mut random, 7);
        let q = SVector::<f64, 7>::from_column_slice(&posture(&mut random, &chain));
        let here = chain.forward(q.as_slice());
        let at_base =
            numerical_jacobian::<6, 7>(&q, |q| (chain.forward(q.as_slice()) * here.inverse()).log());
        let at_flange =
            numerical_jacobian::<6, 7>(&q, |q| (here.inverse() * chain.forward(q.as_slice())).log());
        let (from_base, base) = chain.base_jacobian(q.as_slice());
        let (from_flange, flange) = chain.flange_jacobian(q.as_slice());
        assert_eq!(from_base, here);
        assert_eq!(from_flange, here);
        for i in 0..7 {
            assert!((base[i] - at_base.column(i)).amax() < 1e-7, "{} {}", base[i], at_base.column(i));
            assert!((flange[i] - at_flange.column(i)).amax() < 1e-7);
            assert!((here.adjoint() * flange[i] - base[i]).amax() < 1e-12);
        }
        assert!(base[7..].iter().all(|c| c.amax() == 0.0));
    }
}

#[test]
fn batches_agree_with_single_configurations_on_every_unit() {
    let mut random = Random::new(4);
    for (chain, count) in [(ur5e(), 37), (ur5e(), 8), (ur5e(), 1), (random_chain(&mut random, 5), 9)] {
        let n = chain.len();
        let q: Vec<f64> = (0..count).flat_map(|_| posture(&mut random, &chain)).collect();
        for unit in VectorUnit::ALL {
            let mut poses = vec![f64::NAN; count * 16];
            chain.forward_all_on(unit, &q, &mut poses).unwrap();
            for (q, pose) in q.chunks(n).zip(poses.chunks(16)) {
                let difference = Matrix4::from_row_slice(pose) - chain.forward(q).to_matrix();
                assert!(difference.amax() < 3e-15, "{}: {difference}", unit.name());
            }
        }
        for frame in [Frame::Base, Frame::Flange] {
            let mut jacobians = vec![f64::NAN; count * 6 * n];
            chain.jacobian_all(frame, &q, &mut jacobians).unwrap();
            for (q, jacobian) in q.chunks(n).zip(jacobians.chunks(6 * n)) {
                let columns =
                    if frame == Frame::Base { chain.base_jacobian(q).1 } else { chain.flange_jacobian(q).1 };
                for i in 0..n {
                    for row in 0..6 {
                        assert_eq!(jacobian[row * n + i], columns[i][row]);
                    }
                }
            }
        }
    }
}

#[test]
fn huge_angles_take_the_exact_way() {
    let chain = ur5e();
    let q = [1e7, -3e8, 2.0, 0.1, 5e6, -0.2];
    let mut pose = [0.0; 16];
    chain.forward_all(&q, &mut pose).unwrap();
    assert_eq!(Matrix4::from_row_slice(&pose), chain.forward(&q).to_matrix());
}

#[test]
fn inverse_reaches_what_is_reachable_and_keeps_the_limits() {
    let mut random = Random::new(5);
    let ur5e = ur5e();
    let tight = Chain::new(
        ur5e.joints().iter().map(|j| Joint { lower: -2.0, upper: 1.5, ..*j }).collect(),
        *ur5e.tip(),
    )
    .unwrap();
    let options = InverseOptions::default();
    let mut attempts = 0;
    for _ in 0..200 {
        for chain in [&ur5e, &tight] {
            let goal = chain.forward(&posture(&mut random, chain));
            let reach = chain.inverse(&goal, &[0.1; 6], &options).expect("reachable");
            assert!(chain.within_limits(&reach.joints));
            let off = (chain.forward(&reach.joints) * goal.inverse()).log();
            assert!(off.amax() < 1e-8, "{off}");
            attempts += reach.attempts;
        }
    }
    assert!(attempts < 2000, "{attempts} starts for 400 goals");
}

#[test]
fn inverse_stays_in_the_posture_it_starts_near() {
    let mut random = Random::new(6);
    let chain = ur5e();
    let mut near = 0;
    for _ in 0..100 {
        let truth = posture(&mut random, &chain);
        let start: Vec<f64> = truth.iter().map(|q| q + random.uniform(-0.05, 0.05)).collect();
        let reach = chain.inverse(&chain.forward(&truth), &start, &InverseOptions::default()).unwrap();
        near += usize::from(reach.joints.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-6));
    }
    // A wrist that starts near a singular posture may go through it.
    assert!(near >= 95, "{near}");
}

#[test]
fn all_postures_of_a_pose_are_found() {
    let chain = ur5e();
    let goal = chain.forward(&[0.4, -1.6, 1.7, -1.5, -1.4, 0.3]);
    let options = InverseOptions { attempts: 200, ..InverseOptions::default() };
    let found = chain.inverse_all(&goal, &options);
    // Shoulder left or right, elbow up or down, wrist flipped or not.
    assert_eq!(found.len(), 8, "{found:?}");
    for q in &found {
        assert!(((chain.forward(q) * goal.inverse()).log()).amax() < 1e-8);
    }
}

#[test]
fn what_is_out_of_reach_is_said() {
    let chain = ur5e();
    let goal = Se3::new(nalgebra::Matrix3::identity(), Vector3::new(1.5, 0.0, 0.2));
    let unreached = chain.inverse(&goal, &[0.1; 6], &InverseOptions::default()).unwrap_err();
    assert!(unreached.off_m > 0.3, "{unreached:?}");
    assert!(chain.within_limits(&unreached.joints));
    assert!(unreached.into_error().to_string().contains("does not reach"));
}

#[test]
fn redundant_and_short_arms_are_solved_too() {
    let mut random = Random::new(7);
    let mut reached = 0;
    for _ in 0..40 {
        let chain = random_chain(&mut random, 8);
        let goal = chain.forward(&posture(&mut random, &chain));
        if let Ok(reach) = chain.inverse(&goal, &[0.0; 8], &InverseOptions::default()) {
            assert!(chain.within_limits(&reach.joints));
            assert!((chain.forward(&reach.joints) * goal.inverse()).log().amax() < 1e-8);
            reached += 1;
        }
    }
    assert!(reached >= 38, "{reached}");
    // Three joints reach their own poses, and only those.
    let chain = random_chain(&mut random, 3);
    let goal = chain.forward(&posture(&mut random, &chain));
    assert!(chain.inverse(&goal, &[0.0; 3], &InverseOptions::default()).is_ok());
    let elsewhere = goal * random.transform(0.3, 1.0);
    assert!(chain.inverse(&elsewhere, &[0.0; 3], &InverseOptions::default()).is_err());
}

#[test]
fn frames_are_those_of_the_joints_in_turn() {
    let mut random = Random::new(4);
    let chain = random_chain(&mut random, 7);
    let q = posture(&mut random, &chain);
    let mut frames = [0.0; 9 * 16];
    chain.frames_all(&q, &mut frames).unwrap();
    let frame = |i: usize| Matrix4::from_row_slice(&frames[16 * i..16 * (i + 1)]);
    assert_eq!(frame(0), Matrix4::identity());
    let mut t = Se3::identity();
    for (i, (joint, q)) in chain.joints().iter().zip(&q).enumerate() {
        let moved = match joint.kind {
            JointKind::Revolute => Vector6::new(0.0, 0.0, 0.0, joint.axis.x, joint.axis.y, joint.axis.z) * *q,
            JointKind::Prismatic => {
                Vector6::new(joint.axis.x, joint.axis.y, joint.axis.z, 0.0, 0.0, 0.0) * *q
            }
        };
        t = t * joint.placement * Se3::exp(&moved);
        assert!((frame(i + 1) - t.to_matrix()).amax() < 1e-12, "joint {i}");
    }
    assert!((frame(8) - chain.forward(&q).to_matrix()).amax() < 1e-12);
    assert!(chain.frames_all(&q, &mut [0.0; 16]).is_err());
}

#[test]
fn every_joint_has_its_limits() {
    let mut random = Random::new(12);
    let chain = random_chain(&mut random, 7);
    let q = posture(&mut random, &chain);
    assert!(chain.within_limits(&q));
    for (i, joint) in chain.joints().iter().enumerate() {
        for beyond in [joint.lower - 1e-9, joint.upper + 1e-9, f64::NAN] {
            let mut wrong = q.clone();
            wrong[i] = beyond;
            assert!(!chain.within_limits(&wrong), "joint {i} at {beyond}");
        }
    }
    assert!(!chain.within_limits(&q[..6]));
}

#[test]
fn unusable_chains_and_configurations_are_refused() {
    let joint = *ur5e().joints().first().unwrap();
    let refused = |joint: Joint| Chain::new(vec![joint], Se3::identity()).is_err();
    assert!(refused(Joint { axis: Vector3::zeros(), ..joint }));
    assert!(refused(Joint { axis: Vector3::new(f64::NAN, 0.0, 1.0), ..joint }));
    assert!(refused(Joint { lower: 1.0, upper: -1.0, ..joint }));
    assert!(refused(Joint { lower: f64::NAN, ..joint }));
    assert!(!refused(Joint { lower: f64::NEG_INFINITY, upper: f64::INFINITY, ..joint }));
    assert!(Chain::new(Vec::new(), Se3::identity()).is_err());
    assert!(Chain::new(vec![joint; MAX_JOINTS + 1], Se3::identity()).is_err());
    let chain = ur5e();
    assert!(chain.forward_all(&[0.0; 7], &mut [0.0; 16]).is_err());
    assert!(chain.forward_all(&[0.0; 6], &mut [0.0; 32]).is_err());
    let error = chain.forward_all(&[0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0], &mut [0.0; 16]).unwrap_err();
    assert!(error.to_string().contains("joint 2"));
    assert!(chain.jacobian_all(Frame::Base, &[0.0; 6], &mut [0.0; 35]).is_err());
}
