//! The program `taut`: three asynchronous loops around the god-object method, broadcast to a cluster, monitoring.
//!
//! Begin with [`session`]: Figure 3 of the paper in code. [`loops`] holds its boxes, [`shared`] its arrows.
//!
//! | role          | module      |                                                              |
//! |---------------|-------------|--------------------------------------------------------------|
//! | `taut demo`   | [`demo`]    | the whole workbench on one machine                           |
//! | `taut serve`  | [`serve`]   | the haptic PC                                                |
//! | `taut replay` | [`replay`]  | the same method code on a trace, under a virtual clock       |
//! | `taut record` | [`record`]  | the device trace of a live session                           |
//! | `taut track`  | [`track`]   | the viewer's head, from a tracker on another PC              |
//! | `taut keys`   | [`keys`]    | who may join: the cluster key and credentials                |
//! | `taut doctor` | [`doctor`]  | what this machine lacks                                      |
//!
//! `taut render` and `taut bridge` are the libraries `taut-render` and `taut-bridge`; `taut check` is `taut_scene::check`.

pub mod admission;
pub mod arm;
pub mod audit;
pub mod broadcast;
pub mod checker;
pub mod children;
pub mod cli;
pub mod clients;
pub mod clock;
pub mod config;
pub mod content;
pub mod demo;
pub mod demo_directory;
pub mod devices;
pub mod doctor;
pub mod doctor_device;
pub mod edge_sets;
pub mod failure;
pub mod fidelity;
pub mod finished_file;
pub mod frames;
pub mod head;
pub mod key;
pub mod keys;
pub mod looking_on;
pub mod loops;
pub mod metrics;
pub mod monitor;
pub mod realtime;
pub mod record;
pub mod recorded_session;
pub mod remote_head;
pub mod rendering;
pub mod replay;
pub mod report;
pub mod serve;
pub mod session;
pub mod setup;
pub mod shared;
pub mod shutdown;
pub mod signals;
pub mod stability;
pub mod statistics;
pub mod terminal;
pub mod timing;
pub mod track;
