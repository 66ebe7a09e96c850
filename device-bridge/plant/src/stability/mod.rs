//! How stiff a wall a sampled loop can render: exact eigenvalues, the formulas of the literature, and a verdict in words.
//!
//! | file              | holds                                                                                      |
//! |-------------------|--------------------------------------------------------------------------------------------|
//! | `sampled_loop.rs` | [`SampledLoop`]: the loop's state from sample to sample, its spectral radius, its critical stiffness |
//! | `formulas.rs`     | passivity and stability in closed form                                                      |
//! | `verdict.rs`      | [`DeclaredAxis::verdict`]: the largest stable stiffness, the largest passive one, and why    |

mod formulas;
mod sampled_loop;
mod verdict;

pub use formulas::{linear_limit, passive_damping, passive_limit, passive_limit_quantised};
pub use sampled_loop::SampledLoop;
pub use verdict::{DeclaredAxis, PassiveLimit, StableLimit, Verdict};
