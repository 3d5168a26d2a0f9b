//! The table of methods and the automatic choice.

use super::Scene;
use crate::closed_form::Method;
use crate::closed_form::automatic::rank;
use crate::error::Error;
use crate::se3::Se3;
use crate::testing::Random;

#[test]
fn names_round_trip_and_papers_are_given() {
    for method in Method::ALL {
        assert_eq!(Method::from_name(method.name()), Ok(method));
        assert!(method.paper().contains("19") || method.paper().contains("20"));
        assert!(!method.paper().contains("  "), "{}", method.paper());
    }
    let Err(Error::InvalidInput { what }) = Method::from_name("tsai") else { panic!() };
    assert!(what.contains("tsai_lenz") && what.contains("shah"));
}

#[test]
fn automatic_choice_ranks_by_cost_and_keeps_failures() {
    let mut random = Random::new(27);
    let scene = Scene::random(&mut random, 8, 0.5).noisy(&mut random, (0.0, 0.0), (1e-3, 2e-3));
    let misfit = |x: &Se3, y: &Se3| -> f64 {
        scene.a.iter().zip(&scene.c).map(|(a, c)| (c.inverse() * (*x * *a * *y)).log().norm_squared()).sum()
    };
    let mut calls = 0;
    let ranking = rank(&scene.a, &scene.c, |x, y| {
        calls += 1;
        match calls {
            2 => Err(Error::numerical("target behind the camera")),
            3 => Ok(f64::NAN),
            _ => Ok(misfit(x, y)),
        }
    })
    .unwrap();
    assert_eq!(calls, Method::ALL.len());
    assert_eq!(ranking.candidates.len(), Method::ALL.len() - 2);
    let failed: Vec<Method> = ranking.failures.iter().map(|(method, _)| *method).collect();
    assert_eq!(failed, [Method::ALL[1], Method::ALL[2]]);
    assert!(ranking.candidates.windows(2).all(|pair| pair[0].cost <= pair[1].cost));
    let best = ranking.best();
    assert_eq!(best.cost, misfit(&best.x, &best.y));
    assert_eq!(ranking.distinct(Method::ALL.len(), 10.0, 4.0).len(), 1);
    assert_eq!(ranking.distinct(Method::ALL.len(), 0.0, 0.0).len(), ranking.candidates.len());
    assert_eq!(ranking.distinct(2, 0.0, 0.0), [&ranking.candidates[0], &ranking.candidates[1]]);

    assert!(rank(&scene.a, &scene.c, |_, _| Err(Error::numerical("never"))).is_err());
    assert!(matches!(rank(&scene.a[..2], &scene.c[..2], |_, _| Ok(0.0)), Err(Error::TooFewViews { .. })));
}
