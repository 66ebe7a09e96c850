//! The colours of the picture and the plots, the same as the render clients', sRGB.

/// God-object: warm orange.
pub(crate) const GOD_OBJECT: [u8; 3] = [242, 140, 51];
/// Obstacles: light grey-blue.
pub(crate) const OBSTACLE: [u8; 3] = [158, 176, 199];
/// Obstacles are a little translucent, so that contacts inside a hole are seen.
pub(crate) const OBSTACLE_OPACITY: u8 = 150;
/// Device ghost: translucent cyan.
pub(crate) const DEVICE: [u8; 4] = [64, 214, 230, 70];
/// Contact points: red.
pub(crate) const CONTACT: [u8; 3] = [235, 51, 51];
/// Force and normals: yellow.
pub(crate) const FORCE: [u8; 3] = [250, 217, 51];
/// Contact normals: paler than the force, which matters more.
pub(crate) const NORMAL: [u8; 3] = [255, 236, 150];
/// Screens and head.
pub(crate) const WORKBENCH: [u8; 3] = [120, 120, 130];

/// Plots: x, y, z and the magnitude.
pub(crate) const AXES: [[u8; 3]; 4] = [[229, 72, 77], [70, 190, 100], [80, 140, 255], FORCE];
/// The same three times: the newest, and darker the least and the largest.
pub(crate) const AXES_WITH_ENVELOPE: [[u8; 3]; 12] = [
    AXES[0], AXES[1], AXES[2], AXES[3], DARK[0], DARK[1], DARK[2], DARK[3], DARK[0], DARK[1],
    DARK[2], DARK[3],
];
const DARK: [[u8; 3]; 4] = [[114, 36, 38], [35, 95, 50], [40, 70, 127], [125, 108, 25]];
/// Plots: one hue per loop (haptics, god-object, force), bright for the 99th percentile, pale for the longest.
pub(crate) const LOOPS: [[u8; 3]; 9] = [
    [40, 120, 135],
    [64, 214, 230],
    [178, 240, 246],
    [150, 90, 35],
    GOD_OBJECT,
    [249, 205, 164],
    [135, 115, 30],
    FORCE,
    NORMAL,
];

/// Behind the 3D picture: dark, neutral.
pub(crate) const BACKGROUND: [u8; 3] = [22, 25, 31];
