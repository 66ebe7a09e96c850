//! The shared data of Figure 3: one file per arrow, one writer each, wait-free.
//!
//! ```text
//!            device_state                        contact_snapshot
//!  haptics ───────────────► god-object loop ───────────────────────► coupling
//!     ▲  └────────────────────────────────────────────────────────►  │   │
//!     │                          ▲        shaded_acceleration         │   │
//!     │                          └────────────────────────────────────┘   │
//!     └───────────────────────────── wrench_command ──────────────────────┘
//! ```
//!
//! Broadcast, monitor and checker read the same data and write none. Beside the arrows stand what every thread uses: session time, timing,
//! the request to stop, and why a command failed.

pub mod atomic_f64;
pub(crate) mod clock;
pub mod contact_snapshot;
pub mod device_state;
pub mod failure;
pub(crate) mod fanout;
pub mod felt_ticks;
pub(crate) mod lock;
pub(crate) mod passed_wrench;
pub mod shaded_acceleration;
pub mod shutdown;
pub mod timing;
pub mod wrench_command;
