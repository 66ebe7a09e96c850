//! What a recording is made of: `cargo run -p taut-monitor --example bytes -- FILE.rrd` prints rows and uncompressed bytes of each entity.

use std::path::Path;

fn main() {
    let Some(file) = std::env::args().nth(1) else {
        eprintln!("give a recording (.rrd)");
        return;
    };
    match taut_monitor::inspect(Path::new(&file)) {
        Ok(summary) => {
            for (entity, bytes) in &summary.bytes {
                println!(
                    "{bytes:>12} bytes {:>8} rows {entity}",
                    summary.rows[entity]
                );
            }
            let from = summary.first_time_s.unwrap_or(0.0);
            println!("{:.1} s", summary.last_time_s.unwrap_or(0.0) - from);
        }
        Err(error) => eprintln!("{error}"),
    }
}
