//! String-driven haptic devices (SPIDAR-G): pose from encoder lengths, bounded string tensions from a wrench.
