//! Tests of all lenses together.
