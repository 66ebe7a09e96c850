//! Control recipes under a virtual clock.
