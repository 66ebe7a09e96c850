//! `taut calibrate`: a picture by which a person judges what a projector does to each screen. The work is `taut_render::calibrate`.

use std::path::Path;

use taut_render::calibrate::{Calibration, CalibrationWindows};
use taut_render::renderer::{Gpu, GpuChoice};
use taut_scene::Workbench;

use super::preview::{failure, write};
use crate::cli::CalibrateArgs;
use crate::session::setup::content::of_workbench;
use crate::shared::failure::Failure;

/// Shows the pictures, or writes them; the files written.
pub(super) fn run(args: &CalibrateArgs) -> Result<Vec<String>, Failure> {
    let workbench = Workbench::load(&args.workbench)?;
    if let Some(fault) = workbench.screen_faults().first() {
        return Err(Failure::bad_input(fault));
    }
    let choice = GpuChoice::of(args.gpu.as_deref());
    match &args.out {
        Some(folder) => write_all(args, &workbench, &choice, folder),
        None => show(args, &workbench, choice).map(|()| Vec::new()),
    }
}

fn write_all(
    args: &CalibrateArgs,
    workbench: &Workbench,
    choice: &GpuChoice,
    folder: &Path,
) -> Result<Vec<String>, Failure> {
    let nodes = match &args.node {
        Some(node) => vec![node.as_str()],
        None => workbench
            .nodes
            .iter()
            .map(|node| node.name.as_str())
            .collect(),
    };
    let nodes = nodes
        .into_iter()
        .map(|node| calibration(args, workbench, node));
    let calibrations = nodes.collect::<Result<Vec<_>, _>>()?;
    std::fs::create_dir_all(folder).map_err(|error| {
        Failure::bad_input(format!(
            "the folder {} cannot be made ({error}); name another one with --out",
            folder.display()
        ))
    })?;
    let mut written = Vec::new();
    for calibration in calibrations {
        let gpu = Gpu::open_with(choice).map_err(failure)?;
        for (name, bytes) in calibration.pictures(gpu).map_err(failure)? {
            let path = folder.join(name);
            write(&path, &bytes, &[])?;
            written.push(path.display().to_string());
        }
    }
    Ok(written)
}

fn show(args: &CalibrateArgs, workbench: &Workbench, gpu: GpuChoice) -> Result<(), Failure> {
    let node = match (&args.node, &workbench.nodes[..]) {
        (Some(name), _) => name,
        (None, [only]) => &only.name,
        (None, nodes) => {
            let names: Vec<&str> = nodes.iter().map(|node| node.name.as_str()).collect();
            return Err(Failure::bad_input(format!(
                "the workbench has the nodes {}; name the one whose windows are here with --node, or write all pictures with --out",
                names.join(", ")
            )));
        }
    };
    let windows = workbench.nodes.iter().find(|known| known.name == *node);
    let windows = windows.map(|known| &known.window);
    let calibration = calibration(args, workbench, node)?;
    let monitors = match windows {
        Some(window) if args.monitor.is_empty() => window.monitors.clone(),
        _ => args.monitor.clone(),
    };
    let shown = calibration.show(&CalibrationWindows {
        fullscreen: args.fullscreen || windows.is_some_and(|window| window.fullscreen),
        monitors,
        gpu,
    });
    shown.map_err(failure)
}

fn calibration(
    args: &CalibrateArgs,
    workbench: &Workbench,
    node: &str,
) -> Result<Calibration, Failure> {
    let described = of_workbench(&workbench.name, Calibration::body(), workbench);
    let folder = args.workbench.parent().unwrap_or(Path::new(""));
    Calibration::new(&described, node, folder).map_err(failure)
}
