//! Alternatives that a user names by a word: each variant of an enumeration declares its word and one sentence of
//! meaning beside its code, and readers of case files, schemas and reference pages take both from here.

/// A set of alternatives with words.
pub trait Choice: Copy + PartialEq + std::fmt::Debug + 'static {
    /// The alternatives that can be chosen, in the order in which they are listed.
    const ALL: &'static [Self];

    /// The word in case files: lower case, joined by underscores.
    fn word(self) -> &'static str;

    /// Meaning of the alternative, from its documentation.
    fn about(self) -> &'static str;

    /// The alternative of that word.
    #[must_use]
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.word() == word)
    }
}

/// Declares an enumeration whose variants have words, and implements [`Choice`](crate::choice::Choice) and
/// [`Display`](std::fmt::Display) for it.
///
/// The documentation of the enumeration and of its variants is the text of reference pages. A variant marked
/// `#[unlisted]` is for code alone: it has a word for messages, but no user can choose it.
///
/// ```
/// use sazanami_numerics::choice::Choice;
///
/// sazanami_numerics::choices! {
///     /// Slope in the donor cell.
///     #[derive(Default)]
///     pub enum Limiter {
///         /// Harmonic mean of the differences on both sides (van Leer 1974).
///         #[default]
///         VanLeer = "van_leer",
///         /// The smaller difference.
///         Minmod = "minmod",
///         /// No slope at all.
///         #[unlisted]
///         Upwind = "upwind",
///     }
/// }
///
/// assert_eq!(Limiter::from_word("minmod"), Some(Limiter::Minmod));
/// assert_eq!(Limiter::from_word("upwind"), None);
/// assert_eq!(Limiter::Minmod.about(), "The smaller difference.");
/// assert_eq!(Limiter::VanLeer.to_string(), "van_leer");
/// ```
#[macro_export]
macro_rules! choices {
    ($(
        $(#[doc = $subject:literal])+
        $(#[derive($($derived:ident),*)])?
        $visibility:vis enum $name:ident {
            $($(#[doc = $about:literal])+ $(#[default $($default:ident)?])? $(#[unlisted $($unlisted:ident)?])?
                $variant:ident = $word:literal,)+
        }
    )+) => {$(
        $(#[doc = $subject])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq $(, $($derived),*)?)]
        $visibility enum $name {
            $($(#[doc = $about])+ $(#[default $($default)?])? $variant,)+
        }

        impl $crate::choice::Choice for $name {
            const ALL: &'static [Self] = &{
                const COUNT: usize = 0 $(+ $crate::choices!(@listed $(#[unlisted $($unlisted)?])?))+;
                let all = [$((Self::$variant, $crate::choices!(@listed $(#[unlisted $($unlisted)?])?) == 1)),+];
                let mut listed = [all[0].0; COUNT];
                let (mut n, mut next) = (0, 0);
                while n < all.len() {
                    if all[n].1 {
                        listed[next] = all[n].0;
                        next += 1;
                    }
                    n += 1;
                }
                listed
            };

            fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }

            fn about(self) -> &'static str {
                match self {
                    $(Self::$variant => const { concat!($($about),+).trim_ascii() },)+
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str($crate::choice::Choice::word(*self))
            }
        }
    )+};
    (@listed) => { 1 };
    (@listed #[unlisted]) => { 0 };
}
