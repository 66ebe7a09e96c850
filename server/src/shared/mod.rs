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
//! Broadcast, monitor and checker read the same data and write none.

pub mod contact_snapshot;
pub mod device_state;
pub mod fanout;
pub mod shaded_acceleration;
pub mod wrench_command;
