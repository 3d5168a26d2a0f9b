//! Which parameters of camera and board are free.

/// Parameters that act on the pixels directly.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelParameters {
    /// Indices of the free camera parameters, in the lens' order.
    pub camera: Vec<usize>,
    /// Whether the scale of the board is free (last column): points become `(1 + s) P`.
    pub board_scale: bool,
}

impl PixelParameters {
    /// How many parameters there are.
    pub fn count(&self) -> usize {
        self.camera.len() + usize::from(self.board_scale)
    }
}
