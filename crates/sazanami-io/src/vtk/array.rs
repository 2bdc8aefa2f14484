//! Named arrays.

use std::borrow::Cow;

use sazanami_numerics::Vector;

use crate::{Element, ElementType};

/// Distance from the origin over the extent of points up to which four bytes tell a hundred-thousandth of that extent.
const FAR: f64 = 100.0;

/// A named array of scalars or vectors, one per cell or body.
#[derive(Clone, Debug)]
pub struct DataArray<'a> {
    pub(super) name: String,
    pub(super) components: usize,
    pub(super) element: ElementType,
    pub(super) bytes: Cow<'a, [u8]>,
}

impl<'a> DataArray<'a> {
    /// Values as they are; those of a vector stand together.
    #[must_use]
    pub fn new<T: Element>(name: &str, components: usize, values: &'a [T]) -> Self {
        let bytes = Cow::Borrowed(bytemuck::cast_slice(values));
        Self { name: name.to_owned(), components, element: T::TYPE, bytes }
    }

    /// Values made for this array.
    pub(super) fn owned<T: Element>(name: &str, components: usize, values: &[T]) -> Self {
        let bytes = Cow::Owned(bytemuck::cast_slice(values).to_vec());
        Self { name: name.to_owned(), components, element: T::TYPE, bytes }
    }

    /// Places of points \[m]: in four bytes, or in eight where `double` asks for them or they lie so far from the origin that four would blur
    /// them.
    pub(super) fn places(places: &[Vector], double: bool) -> Self {
        let ends = places.iter().fold([Vector::INFINITY, Vector::NEG_INFINITY], |[a, b], &x| [a.min(x), b.max(x)]);
        let farthest = ends[0].abs().max(ends[1].abs()).max_element();
        let is_near = places.is_empty() || farthest <= FAR * (ends[1] - ends[0]).max_element();
        if is_near && !double {
            let values: Vec<f32> = places.iter().flat_map(|place| place.as_vec3().to_array()).collect();
            return Self::owned("Points", 3, &values);
        }
        let values: Vec<f64> = places.iter().flat_map(|place| place.to_array()).collect();
        Self::owned("Points", 3, &values)
    }

    /// Whole numbers.
    #[must_use]
    pub fn whole(name: &str, values: impl IntoIterator<Item = u32>) -> Self {
        Self::owned(name, 1, &values.into_iter().collect::<Vec<u32>>())
    }

    /// Name of the array.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Values rounded to single precision, which is enough for pictures.
    #[must_use]
    pub fn rounded(name: &str, components: usize, values: impl IntoIterator<Item = f64>) -> Self {
        let single: Vec<f32> = values.into_iter().map(|value| value as f32).collect();
        Self::owned(name, components, &single)
    }

    /// Vectors given by component, rounded to single precision.
    #[must_use]
    pub fn rounded_vectors(name: &str, parts: [&[f64]; 3]) -> Self {
        let [a, b, c] = parts;
        let vectors = a.iter().zip(b).zip(c).flat_map(|((&a, &b), &c)| [a, b, c]);
        Self::rounded(name, 3, vectors)
    }

    /// Number of values, a vector counted by its components.
    pub(super) fn len(&self) -> usize {
        self.bytes.len() / self.element.width()
    }

    pub(super) fn type_name(&self) -> &'static str {
        match self.element {
            ElementType::U8 => "UInt8",
            ElementType::U32 => "UInt32",
            ElementType::I32 => "Int32",
            ElementType::U64 => "UInt64",
            ElementType::I64 => "Int64",
            ElementType::F32 => "Float32",
            ElementType::F64 => "Float64",
        }
    }
}
