//! Where an error of the robot acts in the chain.

/// On which side of `A_k` the robot's error acts.
///
/// Eye-in-hand: `A = T_flange_base`, so left is the flange and right the base; eye-to-hand the other way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// `X exp(eps) A Y`.
    Left,
    /// `X A exp(eps) Y`.
    Right,
}
