//! A haptic device and the hand that holds it as a simulated plant, and the stability of the closed loop.
