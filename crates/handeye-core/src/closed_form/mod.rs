//! Closed-form starts for `AX = XB` and `AX = YB`, one file per method.
//!
//! Given the robot's transforms `A[k]` and the measured `C[k]` of K views with `C[k] ~ X A[k] Y`, every
//! method returns `X` and `Y`. Eye-in-hand: `X = T_camera_flange`, `A = T_flange_base`, `Y = T_base_target`;
//! eye-to-hand: `X = T_camera_base`, `A = T_base_flange`, `Y = T_flange_target`; always
//! `C = T_camera_target`. The algebra is the same.
//!
//! Two families:
//! - [`Family::HandEye`], the papers' `AX = XB`, works on relative motions between views and knows only
//!   `Z = X^-1`: `(A_j A_i^-1) Z = Z (C_j C_i^-1)`. `Y` is then the mean of what the views say.
//! - [`Family::RobotWorld`], the papers' `AX = YB`, works on the views themselves and solves for both at
//!   once: `C[k] Y^-1 = X A[k]`.
//!
//! Both are determined by the same condition, rotation about at least two axes, which [`degeneracy`] decides
//! once for all methods. What is not determined is refused, never answered with a plausible number.

mod andreff;
pub mod automatic;
mod chen;
mod daniilidis;
pub mod degeneracy;
mod dornaika_horaud;
mod estimate;
mod fassi_legnani;
mod horaud_dornaika;
mod li_wang_wu;
mod liang_mao;
mod linear;
mod mean;
mod motion;
mod park_martin;
mod quaternion;
mod rotation_fit;
mod screw;
mod shah;
mod shiu_ahmad;
#[cfg(test)]
mod tests;
mod translation;
mod tsai_lenz;
mod zhuang_roth_sudhakar;

use crate::error::Error;
use crate::se3::Se3;
use degeneracy::AxisSpread;
pub use estimate::Estimate;
use motion::Motion;
pub use motion::{HALF_TURN_MARGIN_RAD, MAX_PAIRS};

/// Fewest views: two relative motions with different axes need three.
pub const MIN_VIEWS: usize = 3;

/// Which equation a method solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// `AX = XB` on relative motions.
    HandEye,
    /// `AX = YB` on the views themselves.
    RobotWorld,
}

impl Family {
    /// The equation as the literature writes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::HandEye => "AX = XB",
            Self::RobotWorld => "AX = YB",
        }
    }
}

/// A closed-form method; each has its own file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Shiu and Ahmad 1989.
    ShiuAhmad,
    /// Tsai and Lenz 1989.
    TsaiLenz,
    /// Chen 1991, screw axes.
    Chen,
    /// Park and Martin 1994.
    ParkMartin,
    /// Horaud and Dornaika 1995, closed-form quaternion solution.
    HoraudDornaika,
    /// Andreff, Horaud and Espiau 1999.
    Andreff,
    /// Daniilidis 1999.
    Daniilidis,
    /// Fassi and Legnani 2005, screw axes and their common normals.
    FassiLegnani,
    /// Liang and Mao 2008, Kronecker solution.
    LiangMao,
    /// Zhuang, Roth and Sudhakar 1994.
    ZhuangRothSudhakar,
    /// Dornaika and Horaud 1998, closed-form solution.
    DornaikaHoraud,
    /// Li, Wang and Wu 2010, Kronecker solution.
    LiWangWu,
    /// Shah 2013.
    Shah,
}

/// How a method is called: on relative motions for `Z = X^-1`, or on the views for both.
#[derive(Clone, Copy)]
enum Solver {
    Motions(fn(&[Motion]) -> Result<Se3, Error>),
    Views(fn(&[Se3], &[Se3]) -> Result<Estimate, Error>),
}

/// One line of the table of methods.
struct Entry {
    name: &'static str,
    paper: &'static str,
    solver: Solver,
}

impl Method {
    /// Every method, the `AX = XB` family first, each family by year.
    pub const ALL: [Self; 13] = [
        Self::ShiuAhmad,
        Self::TsaiLenz,
        Self::Chen,
        Self::ParkMartin,
        Self::HoraudDornaika,
        Self::Andreff,
        Self::Daniilidis,
        Self::FassiLegnani,
        Self::LiangMao,
        Self::ZhuangRothSudhakar,
        Self::DornaikaHoraud,
        Self::LiWangWu,
        Self::Shah,
    ];

    fn entry(self) -> Entry {
        let (name, paper, solver) = match self {
            Self::ShiuAhmad => ("shiu_ahmad", shiu_ahmad::PAPER, Solver::Motions(shiu_ahmad::solve)),
            Self::TsaiLenz => ("tsai_lenz", tsai_lenz::PAPER, Solver::Motions(tsai_lenz::solve)),
            Self::Chen => ("chen", chen::PAPER, Solver::Motions(chen::solve)),
            Self::ParkMartin => ("park_martin", park_martin::PAPER, Solver::Motions(park_martin::solve)),
            Self::HoraudDornaika => {
                ("horaud_dornaika", horaud_dornaika::PAPER, Solver::Motions(horaud_dornaika::solve))
            }
            Self::Andreff => ("andreff", andreff::PAPER, Solver::Motions(andreff::solve)),
            Self::Daniilidis => ("daniilidis", daniilidis::PAPER, Solver::Motions(daniilidis::solve)),
            Self::FassiLegnani => {
                ("fassi_legnani", fassi_legnani::PAPER, Solver::Motions(fassi_legnani::solve))
            }
            Self::LiangMao => ("liang_mao", liang_mao::PAPER, Solver::Motions(liang_mao::solve)),
            Self::ZhuangRothSudhakar => (
                "zhuang_roth_sudhakar",
                zhuang_roth_sudhakar::PAPER,
                Solver::Views(zhuang_roth_sudhakar::solve),
            ),
            Self::DornaikaHoraud => {
                ("dornaika_horaud", dornaika_horaud::PAPER, Solver::Views(dornaika_horaud::solve))
            }
            Self::LiWangWu => ("li_wang_wu", li_wang_wu::PAPER, Solver::Views(li_wang_wu::solve)),
            Self::Shah => ("shah", shah::PAPER, Solver::Views(shah::solve)),
        };
        Entry { name, paper, solver }
    }

    /// The name by which users choose the method, such as `"park_martin"`.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The paper that the method comes from.
    pub fn paper(self) -> &'static str {
        self.entry().paper
    }

    /// The equation that the method solves.
    pub fn family(self) -> Family {
        match self.entry().solver {
            Solver::Motions(_) => Family::HandEye,
            Solver::Views(_) => Family::RobotWorld,
        }
    }

    /// The method with the given name.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] naming the known methods.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|method| method.name()).collect();
            Error::invalid(format!(
                "no closed-form method is called {name:?}; known are {}",
                known.join(", ")
            ))
        })
    }
}

/// Views that passed the checks shared by all methods, with their relative motions.
struct Prepared<'a> {
    a: &'a [Se3],
    c: &'a [Se3],
    motions: Vec<Motion>,
}

impl<'a> Prepared<'a> {
    fn new(a: &'a [Se3], c: &'a [Se3]) -> Result<Self, Error> {
        let motions = relative_motions(a, c)?;
        AxisSpread::of(&motions)?.require_two_axes()?;
        Ok(Self { a, c, motions: motions.usable })
    }

    fn solve(&self, method: Method) -> Result<Estimate, Error> {
        let estimate = match method.entry().solver {
            Solver::Motions(solve) => {
                let x = solve(&self.motions)?.inverse();
                Estimate { x, y: mean::remaining_transform(&x, self.a, self.c)? }
            }
            Solver::Views(solve) => solve(self.a, self.c)?,
        };
        if is_finite(&estimate.x) && is_finite(&estimate.y) {
            Ok(estimate)
        } else {
            Err(Error::numerical(format!("{} ended in numbers that are not finite", method.name())))
        }
    }
}

fn is_finite(t: &Se3) -> bool {
    t.rotation.iter().chain(t.translation.iter()).all(|x| x.is_finite())
}

/// Checks the views and pairs them.
fn relative_motions(a: &[Se3], c: &[Se3]) -> Result<motion::Motions, Error> {
    if a.len() != c.len() {
        return Err(Error::invalid(format!(
            "{} robot transforms (A) but {} camera transforms (C); there must be one of each per view",
            a.len(),
            c.len()
        )));
    }
    if a.len() < MIN_VIEWS {
        return Err(Error::TooFewViews { given: a.len(), needed: MIN_VIEWS });
    }
    for (name, transforms) in [("A", a), ("C", c)] {
        if let Some(k) = transforms.iter().position(|t| !is_finite(t)) {
            return Err(Error::invalid(format!("{name}[{k}] has an entry that is not a finite number")));
        }
    }
    Ok(motion::Motions::between(a, c))
}

/// Solves `C[k] ~ X A[k] Y` for `X` and `Y`.
///
/// # Errors
/// - [`Error::InvalidInput`]: lists of different length, or an entry that is not finite.
/// - [`Error::TooFewViews`]: fewer than [`MIN_VIEWS`].
/// - [`Error::Degenerate`]: the views do not determine the answer (see [`degeneracy`]).
/// - [`Error::Numerical`]: the method itself found no answer in these views, although there is one.
pub fn solve(method: Method, a: &[Se3], c: &[Se3]) -> Result<Estimate, Error> {
    Prepared::new(a, c)?.solve(method)
}

/// How far the rotation axes of the views spread, the evidence on which degenerate views are refused.
///
/// # Errors
/// [`Error::InvalidInput`] and [`Error::TooFewViews`] as for [`solve`].
pub fn axis_spread(a: &[Se3], c: &[Se3]) -> Result<AxisSpread, Error> {
    AxisSpread::of(&relative_motions(a, c)?)
}
