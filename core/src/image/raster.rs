//! A dense row-major raster with its origin at the top-left corner.

/// Values over `width × height` pixels, row-major, top-left first, no padding.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    width: u32,
    height: u32,
    values: Vec<T>,
}

impl<T: Copy> Raster<T> {
    /// A raster filled with `value`.
    pub fn filled(width: u32, height: u32, value: T) -> Self {
        Self { width, height, values: vec![value; width as usize * height as usize] }
    }

    /// A raster over `values`; `None` when their number is not `width × height`.
    pub fn from_values(width: u32, height: u32, values: Vec<T>) -> Option<Self> {
        (values.len() == width as usize * height as usize).then_some(Self { width, height, values })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, row by row, to write to.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Row `v`, left to right.
    pub fn row(&self, v: u32) -> &[T] {
        let start = v as usize * self.width as usize;
        &self.values[start..start + self.width as usize]
    }

    /// The value at column `u`, row `v`; panics outside.
    pub fn at(&self, u: u32, v: u32) -> T {
        self.row(v)[u as usize]
    }

    /// Writes the value at column `u`, row `v`; panics outside.
    pub fn set(&mut self, u: u32, v: u32, value: T) {
        let index = v as usize * self.width as usize + u as usize;
        self.values[index] = value;
    }
}
