//! Symmetric 6 x 6 matrices by their upper triangle.

/// Entries of a symmetric 6 x 6 matrix, upper triangle row by row.
pub(crate) const UPPER: usize = 21;

/// Where entry `(i, j)`, in either order, of a symmetric 6 x 6 matrix lies in its upper triangle.
pub(crate) const fn upper(i: usize, j: usize) -> usize {
    let (i, j) = if i <= j { (i, j) } else { (j, i) };
    i * 6 - i * (i + 1) / 2 + j
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_triangle_is_numbered_row_by_row() {
        let mut next = 0;
        for i in 0..6 {
            for j in i..6 {
                assert_eq!((upper(i, j), upper(j, i)), (next, next));
                next += 1;
            }
        }
        assert_eq!(next, UPPER);
    }
}
