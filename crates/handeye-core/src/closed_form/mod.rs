//! Closed-form starts for `AX = XB` and `AX = YB`, one file per method.
