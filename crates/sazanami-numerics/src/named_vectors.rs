//! Sums of vectors that have names in files: the fields of a struct are the one list of them.

/// Declares a struct of vectors whose fields are lines of a budget, in the order in which files and snapshots have them.
/// A line enters a total with the sign that follows it, `+1` where there is none.
///
/// ```
/// use sazanami_numerics::Vector;
///
/// sazanami_numerics::named_vectors! {
///     /// Impulses [N s].
///     pub struct Impulses {
///         /// Of walls.
///         walls,
///         /// Of what is displaced.
///         displaced = -1.0,
///     }
/// }
///
/// assert_eq!(Impulses::TERMS, [("walls", 1.0), ("displaced", -1.0)]);
/// let mut sum = Impulses::from_terms([Vector::X, Vector::Y]);
/// sum += Impulses { displaced: Vector::Z, ..Impulses::default() };
/// assert_eq!(sum.terms().collect::<Vec<_>>(), [Vector::X, Vector::Y + Vector::Z]);
/// ```
#[macro_export]
macro_rules! named_vectors {
    (
        $(#[$of_struct:meta])*
        $visibility:vis struct $name:ident {
            $($(#[$about:meta])* $field:ident $(= $sign:literal)?,)+
        }
    ) => {
        $(#[$of_struct])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        $visibility struct $name {
            $($(#[$about])* pub $field: $crate::Vector,)+
        }

        impl $name {
            /// Names of the lines, and their signs in the total.
            pub const TERMS: [(&'static str, $crate::Real); [$(stringify!($field)),+].len()] =
                [$((stringify!($field), $crate::named_vectors!(@sign $($sign)?))),+];

            /// The vectors, in the order of [`Self::TERMS`].
            pub fn terms(&self) -> impl Iterator<Item = $crate::Vector> {
                [$(self.$field),+].into_iter()
            }

            /// From the vectors in the order of [`Self::TERMS`]; what is not there is zero.
            pub fn from_terms(terms: impl IntoIterator<Item = $crate::Vector>) -> Self {
                let mut terms = terms.into_iter().fuse();
                let mut next = || terms.next().unwrap_or_default();
                Self { $($field: next(),)+ }
            }
        }

        impl std::ops::AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                $(self.$field += other.$field;)+
            }
        }
    };
    (@sign) => { 1.0 };
    (@sign $sign:literal) => { $sign };
}
