//! Giving up a long calculation because its caller asks for it.
//!
//! Long loops call [`check`], or go over [`checked`] items. Where the caller has said how to ask ([`asking`]), and is
//! told to stop, the calculation is unwound to there. The core itself knows neither clock nor signals.

use std::cell::Cell;
use std::panic::resume_unwind;

/// What a calculation that was given up unwinds with.
#[derive(Debug)]
pub struct Interrupted;

thread_local! {
    static ASK: Cell<Option<fn() -> bool>> = const { Cell::new(None) };
}

/// Puts back how to ask when the calculation is over, however it ends.
struct Before(Option<fn() -> bool>);

impl Drop for Before {
    fn drop(&mut self) {
        ASK.set(self.0);
    }
}

/// Runs a calculation in this thread that stops, by unwinding with [`Interrupted`], soon after `ask` says so.
pub fn asking<T>(ask: fn() -> bool, calculation: impl FnOnce() -> T) -> T {
    let _before = Before(ASK.replace(Some(ask)));
    calculation()
}

/// Stops here if the caller asks for it; to be called every millisecond or so.
pub fn check() {
    if ASK.get().is_some_and(|ask| ask()) {
        resume_unwind(Box::new(Interrupted));
    }
}

/// So many items, of a tenth of a millisecond each at most, are gone over between two checks.
const STRIDE: usize = 64;

/// The same items, with a [`check`] now and then.
pub fn checked<I: IntoIterator>(items: I) -> impl Iterator<Item = I::Item> {
    items.into_iter().enumerate().map(|(number, item)| {
        if number % STRIDE == 0 {
            check();
        }
        item
    })
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    #[test]
    fn a_calculation_stops_where_it_is_asked_to_and_only_there() {
        check();
        let stopped = catch_unwind(|| {
            asking(
                || true,
                || {
                    check();
                    1
                },
            )
        });
        assert!(stopped.is_err_and(|with| with.is::<Interrupted>()));
        check(); // as before
        assert_eq!(asking(|| false, || (check(), 2).1), 2);
    }

    #[test]
    fn items_are_the_same_and_gone_over_no_further_than_asked() {
        let items = 0..3 * STRIDE;
        assert!(checked(items.clone()).eq(items.clone()));
        let mut seen = 0;
        let stopped =
            catch_unwind(AssertUnwindSafe(|| asking(|| true, || checked(items).for_each(|_| seen += 1))));
        assert!(stopped.is_err_and(|with| with.is::<Interrupted>()));
        assert_eq!(seen, 0);
    }
}
