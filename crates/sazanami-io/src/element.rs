//! Types of the elements of arrays in files.

use serde::{Deserialize, Serialize};

/// Type of the elements of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ElementType {
    /// Bytes, and text as UTF-8.
    U8,
    /// 32-bit unsigned integers.
    U32,
    /// 32-bit signed integers.
    I32,
    /// 64-bit unsigned integers.
    U64,
    /// 64-bit signed integers.
    I64,
    /// Single-precision numbers.
    F32,
    /// Double-precision numbers.
    F64,
}

impl ElementType {
    /// Bytes of an element.
    #[must_use]
    pub const fn width(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// Element type of an array in a file.
pub trait Element: bytemuck::Pod {
    /// Name of the type in the file.
    const TYPE: ElementType;
}

macro_rules! element {
    ($($rust:ty => $name:ident),+ $(,)?) => {
        $(impl Element for $rust {
            const TYPE: ElementType = ElementType::$name;
        })+
    };
}
element!(u8 => U8, u32 => U32, i32 => I32, u64 => U64, i64 => I64, f32 => F32, f64 => F64);
