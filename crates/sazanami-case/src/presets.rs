//! Sets of defaults. What `paper_literal` sets is declared with each key; here is whose paper it follows.

use sazanami_numerics::choices;

choices! {
    /// Solver for the water and the air.
    pub enum Solver {
        /// One grid for liquid, gas and grains of any shape.
        Mics = "mics",
        /// Moving particles of liquid that overlap spheres.
        Mps = "mps",
    }

    /// Set of defaults.
    pub enum Preset {
        /// The settings that work best.
        Recommended = "recommended",
        /// The scheme of the solver's paper to the letter, where the letter is known.
        PaperLiteral = "paper_literal",
    }

    /// A paper that the preset `paper_literal` follows: that of the case's solver.
    pub enum Paper {
        /// Yagyu, Ushijima, Toriu and Aoki (2015), for `solver = "mics"`.
        Yagyu = "Yagyu et al.",
        /// Tazaki, Harada, Ikari and Gotoh, for `solver = "mps"`.
        Tazaki = "Tazaki et al.",
    }
}

impl Paper {
    /// The paper of a solver.
    #[must_use]
    pub fn of(solver: Solver) -> Self {
        match solver {
            Solver::Mics => Self::Yagyu,
            Solver::Mps => Self::Tazaki,
        }
    }
}
