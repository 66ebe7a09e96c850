//! The published table of critical stiffness: 0.2 kg, 1 kHz, nobody holds the device.

/// Delays of the columns, s.
pub const DELAYS: [f64; 4] = [0.0, 0.5e-3, 1e-3, 2e-3];

/// Damping of the device and of the wall, N s/m; critical stiffness at each delay, N/m.
pub const CRITICAL: [(f64, f64, [f64; 4]); 6] = [
    (1.0, 0.0, [2002.0, 1001.0, 668.0, 401.0]),
    (1.0, 2.0, [5945.0, 2973.0, 1981.0, 1186.0]),
    (1.0, 5.0, [11714.0, 5857.0, 3895.0, 2321.0]),
    (1.0, 10.0, [20947.0, 10466.0, 6936.0, 4097.0]),
    (5.0, 0.0, [10042.0, 5026.0, 3356.0, 2021.0]),
    (5.0, 5.0, [19594.0, 9805.0, 6530.0, 3905.0]),
];

/// With a light hand (and 1 N s/m of the device): delay, s; critical stiffness, N/m.
pub const CRITICAL_LIGHT: [(f64, f64); 2] = [(0.0, 10_024.0), (1e-3, 3347.0)];
