//! TEMPORARY
use std::sync::RwLock;
/// x
pub static T: RwLock<Vec<f64>> = RwLock::new(Vec::new());
/// x
pub fn tune(i: usize, default: f64) -> f64 { let t = T.read().unwrap(); match t.get(i) { Some(v) if v.is_finite() => *v, _ => default } }
