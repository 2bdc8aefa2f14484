//! Values as written: each keeps its place in the file and accepts any TOML value, so that what is
//! wrong with it can be said later, together with everything else. The type tells what is expected.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use toml::Spanned;

use super::units::Dimension;

/// Any TOML value.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A text.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A number with a fraction.
    Float(f64),
    /// `true` or `false`.
    Flag(bool),
    /// A list, each element with its place.
    List(Vec<At<Item>>),
    /// A table, or a date.
    Table,
}

impl Item {
    /// What kind of value it is, for messages.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Text(_) => "a text",
            Self::Integer(_) | Self::Float(_) => "a bare number",
            Self::Flag(_) => "true or false",
            Self::List(_) => "a list",
            Self::Table => "a table",
        }
    }
}

impl<'de> Deserialize<'de> for Item {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ItemVisitor)
    }
}

struct ItemVisitor;

impl<'de> Visitor<'de> for ItemVisitor {
    type Value = Item;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Item, E> {
        Ok(Item::Flag(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Item, E> {
        Ok(Item::Integer(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Item, E> {
        Ok(i64::try_from(value).map_or(Item::Float(value as f64), Item::Integer))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Item, E> {
        Ok(Item::Float(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Item, E> {
        Ok(Item::Text(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Item, A::Error> {
        let mut list = Vec::new();
        while let Some(element) = sequence.next_element()? {
            list.push(element);
        }
        Ok(Item::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Item, A::Error> {
        while map.next_entry::<serde::de::IgnoredAny, serde::de::IgnoredAny>()?.is_some() {}
        Ok(Item::Table)
    }
}

/// A value with its place in the [`Source`](super::source::Source).
#[derive(Clone, Debug, PartialEq)]
pub struct At<T> {
    /// The value.
    pub value: T,
    /// Its place.
    pub span: Range<usize>,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<T>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(Self { value: spanned.into_inner(), span })
    }
}

impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// Declares leaf types that hold any [`Item`] and say in the JSON Schema what is expected.
macro_rules! leaves {
    ($($(#[$doc:meta])* $name:ident = $schema:tt;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name(pub At<Item>);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                At::<Item>::deserialize(deserializer).map(Self)
            }
        }

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    )*};
}

leaves! {
    /// A pure number.
    Number = { "type": "number" };
    /// A whole number, zero or more.
    Whole = { "type": "integer", "minimum": 0 };
    /// `true` or `false`.
    Flag = { "type": "boolean" };
    /// A text.
    Text = { "type": "string" };
    /// `auto` or a whole number.
    AutoOrWhole = { "oneOf": [{ "const": "auto" }, { "type": "integer", "minimum": 1 }] };
    /// A word with an optional count, `shell(75)`.
    Call = { "type": "string", "pattern": "^[a-z_]+(\\([0-9]+\\))?$" };
    /// Three whole numbers.
    Cells = { "type": "array", "items": { "type": "integer", "minimum": 1 }, "minItems": 3, "maxItems": 3 };
    /// A list of pure numbers.
    Numbers = { "type": "array", "items": { "type": "number" } };
    /// A list of words.
    Words = { "type": "array", "items": { "type": "string" } };
}

/// A kind of quantity: its dimension and how messages speak of it.
pub trait Kind {
    /// Dimension every value of the kind has.
    const DIMENSION: Dimension;
    /// The kind with its article, `a length`.
    const NAME: &'static str;
    /// A value as an example, `0.52 mm`.
    const EXAMPLE: &'static str;
    /// The SI unit the resolved case is written in.
    const SI: &'static str;
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident: $name:literal, $example:literal, $si:literal, $dimension:expr;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $kind;

        impl Kind for $kind {
            const DIMENSION: Dimension = $dimension;
            const NAME: &'static str = $name;
            const EXAMPLE: &'static str = $example;
            const SI: &'static str = $si;
        }
    )*};
}

kinds! {
    /// Length [m].
    Length: "a length", "0.52 mm", "m", Dimension::new(1, 0, 0, 0);
    /// Time [s].
    Time: "a time", "1e-5 s", "s", Dimension::new(0, 0, 1, 0);
    /// Mass [kg].
    Mass: "a mass", "1.93e-7 kg", "kg", Dimension::new(0, 1, 0, 0);
    /// Velocity [m/s].
    Velocity: "a velocity", "9 m/s", "m/s", Dimension::new(1, 0, -1, 0);
    /// Acceleration [m/s^2].
    Acceleration: "an acceleration", "9.8 m/s^2", "m/s^2", Dimension::new(1, 0, -2, 0);
    /// Density [kg/m^3].
    Density: "a density", "2650 kg/m^3", "kg/m^3", Dimension::new(-3, 1, 0, 0);
    /// Kinematic viscosity [m^2/s].
    KinematicViscosity: "a kinematic viscosity", "1e-6 m^2/s", "m^2/s", Dimension::new(2, 0, -1, 0);
    /// Dynamic viscosity [Pa s].
    DynamicViscosity: "a dynamic viscosity", "1e-3 Pa s", "Pa s", Dimension::new(-1, 1, -1, 0);
    /// Pressure [Pa].
    Pressure: "a pressure", "1 kPa", "Pa", Dimension::new(-1, 1, -2, 0);
    /// Stiffness of a spring [N/m].
    Stiffness: "a stiffness", "1e4 N/m", "N/m", Dimension::new(0, 1, -2, 0);
    /// Coefficient of a dashpot [N s/m].
    Dashpot: "a dashpot coefficient", "2.95e-3 N s/m", "N s/m", Dimension::new(0, 1, -1, 0);
    /// Plane angle [rad].
    Angle: "an angle", "30 deg", "rad", Dimension::new(0, 0, 0, 1);
    /// Angular velocity [rad/s].
    AngularVelocity: "an angular velocity", "10 rad/s", "rad/s", Dimension::new(0, 0, -1, 1);
    /// Frequency [Hz].
    Frequency: "a frequency", "2 Hz", "Hz", Dimension::new(0, 0, -1, 0);
}

/// A number with a unit, of the kind `K`.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity<K> {
    /// The value as written.
    pub item: At<Item>,
    kind: PhantomData<K>,
}

/// Three numbers with units, of the kind `K`.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectorial<K> {
    /// The value as written.
    pub item: At<Item>,
    kind: PhantomData<K>,
}

/// Some numbers with units, of the kind `K`.
#[derive(Clone, Debug, PartialEq)]
pub struct Several<K> {
    /// The value as written.
    pub item: At<Item>,
    kind: PhantomData<K>,
}

/// One number with a unit or three, of the kind `K`.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalarOrVector<K> {
    /// The value as written.
    pub item: At<Item>,
    kind: PhantomData<K>,
}

fn quantity_schema<K: Kind>() -> Schema {
    json_schema!({
        "type": "string",
        "pattern": "^\\s*[-+]?[0-9.].*$",
        "description": format!("{} with its unit, for example \"{}\"", K::NAME, K::EXAMPLE),
    })
}

macro_rules! quantities {
    ($($name:ident => |$one:ident| $schema:expr;)*) => {$(
        impl<K> $name<K> {
            /// The value at its place.
            #[must_use]
            pub fn new(item: At<Item>) -> Self {
                Self { item, kind: PhantomData }
            }
        }

        impl<'de, K> Deserialize<'de> for $name<K> {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                At::<Item>::deserialize(deserializer).map(Self::new)
            }
        }

        impl<K: Kind> JsonSchema for $name<K> {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                format!("{} {}", stringify!($name), K::NAME).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                let $one = quantity_schema::<K>();
                $schema
            }
        }
    )*};
}

quantities! {
    Quantity => |one| one;
    Vectorial => |one| json_schema!({ "type": "array", "items": one, "minItems": 3, "maxItems": 3 });
    Several => |one| json_schema!({ "type": "array", "items": one });
    ScalarOrVector => |one| json_schema!({
        "oneOf": [one.clone(), { "type": "array", "items": one, "minItems": 3, "maxItems": 3 }]
    });
}

/// A set of words to choose from.
pub trait ChoiceSet: Copy + PartialEq + 'static {
    /// Every choice.
    const ALL: &'static [Self];
    /// The word in the case file.
    fn word(self) -> &'static str;
    /// The choice of that word.
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.word() == word)
    }
}

/// One word of the set `E`.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice<E> {
    /// The value as written.
    pub item: At<Item>,
    set: PhantomData<E>,
}

impl<'de, E> Deserialize<'de> for Choice<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        At::<Item>::deserialize(deserializer).map(|item| Self { item, set: PhantomData })
    }
}

impl<E: ChoiceSet> JsonSchema for Choice<E> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Choice".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let words: Vec<&str> = E::ALL.iter().map(|choice| choice.word()).collect();
        json_schema!({ "enum": words })
    }
}

/// Declares an enumeration whose members have words in the case file.
macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $word:literal,)* })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)*
        }

        impl $crate::case::written::ChoiceSet for $name {
            const ALL: &'static [Self] = &[$(Self::$variant,)*];

            fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str($crate::case::written::ChoiceSet::word(*self))
            }
        }
    )*};
}
pub(crate) use choices;
