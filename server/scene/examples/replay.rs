//! What `taut replay` writes, by the library alone, on standard output.
//! `cargo run --release -p taut-scene --example replay -- SCENE TRACE > answer.csv`.

use std::error::Error;
use std::io;
use std::path::Path;

use taut_scene::{DeviceTrace, ReplayWriter, Runner, Scene};

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let [scene, trace] = given.as_slice() else {
        return Err("give a scene, shipped or a file, and a trace".into());
    };
    let mut runner = Runner::of_scene(Scene::named_or_file(scene)?.build()?)?;
    let trace = DeviceTrace::load(Path::new(trace))?;
    let mut writer = ReplayWriter::new(io::stdout().lock(), false)?;
    for sample in trace.samples() {
        writer.write(&runner.row(sample.time, &sample.pose, &mut ()))?;
    }
    drop(writer.finish()?);
    Ok(())
}
