//! probe
use taut_tests::checker::PenetrationChecker;
use taut_tests::motion::*;
use taut_scene::*;
use std::time::Instant;
#[test]
fn peg() {
    let scene = shipped("peg-in-a-hole");
    let checker = PenetrationChecker::new(&scene.world);
    let path = intention(&scene);
    let t0 = Instant::now();
    let samples: Vec<_> = lead(&scene, sampled(&path, 1000.0, 0.0, 30.0)).collect();
    println!("peg method {:?}", t0.elapsed());
    let t0 = Instant::now();
    for s in samples.iter() { if checker.penetrated(&s.god_object).is_some() { println!("HIT {}", s.time); } }
    println!("peg check {:?}", t0.elapsed());
}
#[test]
fn bunny() {
    let t0 = Instant::now();
    let scene = shipped("two-bunnies");
    println!("load {:?}", t0.elapsed());
    let checker = PenetrationChecker::new(&scene.world);
    println!("{:?}", scene.settings);
    println!("checker {:?}", t0.elapsed());
    let path = intention(&scene);
    let t0 = Instant::now();
    let samples: Vec<_> = lead(&scene, sampled(&path, 250.0, 0.0, 17.0)).collect();
    println!("bunny method {:?}", t0.elapsed());
    let t0 = Instant::now();
    for s in samples.iter() { if checker.penetrated(&s.god_object).is_some() { println!("HIT {}", s.time); } }
    println!("bunny check {:?}", t0.elapsed());
    println!("touching {}", samples.iter().filter(|s| s.active > 0).count());
    println!("gap {:e}", samples.iter().map(|s| s.gap_min).fold(f64::INFINITY, f64::min));
}
#[test]
fn sphere() {
    let scene = shipped("sphere-on-plane");
    println!("{:?}", scene.settings);
    let checker = PenetrationChecker::new(&scene.world);
    let path = intention(&scene);
    let t0 = Instant::now();
    let samples: Vec<_> = lead(&scene, sampled(&path, 1000.0, 0.0, 11.4)).collect();
    println!("sphere method {:?}", t0.elapsed());
    for s in samples.iter().step_by(5) { if checker.penetrated(&s.god_object).is_some() { println!("HIT {}", s.time); } }
    println!("sphere check {:?}", t0.elapsed());
    for s in samples.iter().step_by(200) {
        let (p, w) = (s.god_object.translation.vector, s.wrench);
        println!("S {:7.3} s {:8.5} {:8.5} {:9.6} F {:10.2e} {:10.2e} {:8.4} T {:8.1e} {:8.1e} {:8.1e} gap {:.2e} act {}", s.time, p.x, p.y, p.z, w[0], w[1], w[2], w[3], w[4], w[5], s.gap_min, s.active);
    }
    let f: Vec<f64> = samples.iter().filter(|s| s.time>1.0 && s.time<10.0).map(|s| s.wrench[2]).collect();
    println!("F_z {} {}", f.iter().copied().fold(f64::INFINITY, f64::min), f.iter().copied().fold(0.0, f64::max));
}
#[test]
fn assembly() {
    for name in ["peg_round_8mm_loose", "peg_round_8mm_tight", "peg_rect_16mm_loose", "gear_on_pin", "nut_bolt_m24"] {
        let t0 = Instant::now();
        let scene = Scene::load(&data_file(format!("assembly/{name}.toml")).unwrap()).unwrap().build().unwrap();
        let trace = DeviceTrace::load(&data_file(format!("assembly/{name}_trace.csv")).unwrap()).unwrap();
        let checker = PenetrationChecker::new(&scene.world);
        println!("{name}: {} x {} load {:?}", scene.world.body.mesh.triangles().len(), scene.world.obstacles[0].mesh.triangles().len(), t0.elapsed());
        let t0 = Instant::now();
        let samples: Vec<_> = lead(&scene, traced(&trace)).collect();
        println!("   method {:?} for {}", t0.elapsed(), samples.len());
        let t0 = Instant::now();
        let hits = samples.iter().step_by(10).filter(|s| checker.penetrated(&s.god_object).is_some()).count();
        println!("   check {:?} hits {hits}", t0.elapsed());
        let worst = samples.iter().map(|s| (s.god_object.translation.vector - s.device.translation.vector).norm()).fold(0.0, f64::max);
        let last = samples.last().unwrap();
        println!("   worst lag {worst:e} last {:e} {:e} force max {} gap {:e} rest {:e}", (last.god_object.translation.vector - last.device.translation.vector).norm(), last.god_object.rotation.angle_to(&last.device.rotation),
          samples.iter().map(|s| s.wrench.fixed_rows::<3>(0).norm()).fold(0.0, f64::max), samples.iter().map(|s| s.gap_min).fold(f64::INFINITY, f64::min), scene.settings.rest_distance);
    }
}
