mod support;
use nalgebra::{Vector3, Vector6};
use support::*;
use taut_spidar::*;
#[test]
fn explore() {
    for g in all() {
        let c = capability(&g, &Pose::identity());
        println!(
            "{} cond {:.2} axisF {:?} axisT {:?} weak {:?} {:?} strong {:?}",
            g.name,
            c.condition,
            c.axis_force,
            c.axis_torque,
            c.weakest_force,
            c.weakest_torque,
            c.strongest_force
        );
        for (r, a) in [(0.02, 0.5), (0.03, 0.7), (0.3, 0.5), (0.15, 0.5)] {
            println!("  ball {r} {a}: {:?}", ball(&g, r, a));
        }
        let mut k = ForwardKinematics::new(&g);
        let l = g.lengths(&Pose::identity());
        let ans = k.solve(&l).unwrap();
        println!("  leverage {:?}", ans.leverage);
        let mut rnd = Random(1);
        let mut worst = [0.0f64; 4];
        let mut s = TensionSolver::new(&g, TensionSettings::default());
        let mut hist = [0u32; 70];
        let mut stat = [0; 4];
        let mut worst_inside = 0.0f64;
        let mut maxf = 0;
        for n in 0..30000 {
            let p = rnd.pose(reach(&g), 0.5);
            let m = StringMatrix::at(&g, &p);
            let mut f = Vector6::zeros();
            f.fixed_rows_mut::<3>(0)
                .copy_from(&(rnd.direction() * rnd.signed().abs() * g.tension_max * 2.0));
            f.fixed_rows_mut::<3>(3)
                .copy_from(&(rnd.direction() * rnd.signed().abs() * g.tension_max * g.arm()));
            let a = s.distribute(&m, &f);
            hist[a.factorisations.min(69) as usize] += 1;
            maxf = maxf.max(a.factorisations);
            stat[a.status as usize] += 1;
            worst[0] = worst[0].max(a.kkt_residual);
            if a.status == TensionStatus::Rendered {
                let e = (a.wrench - f).fixed_rows::<3>(0).norm() / f.norm();
                worst_inside = worst_inside.max(e);
            }
            if a.status == TensionStatus::Scaled {
                let e = (a.wrench - f * a.scale).norm() / (f.norm() * a.scale).max(1e-9);
                worst[1] = worst[1].max(e);
            }
            if a.status == TensionStatus::NotFinite {
                println!("notfinite {n}");
            }
        }
        println!(
            "  kkt {:.1e} inside {:.1e} scaled {:.1e} stat {:?} maxf {maxf} hist {:?}",
            worst[0],
            worst_inside,
            worst[1],
            stat,
            &hist[..30]
        );
        // FK
        let mut steps = [0; 21];
        let mut e = (0.0f64, 0.0f64);
        for _ in 0..2000 {
            let p = rnd.pose(g.half_width() * 0.6, 0.9);
            k.start_at(Pose::identity());
            match k.solve(&g.lengths(&p)) {
                Ok(a) => {
                    steps[a.steps as usize] += 1;
                    let d = apart(&a.frame_from_grip, &p);
                    e = (e.0.max(d.0), e.1.max(d.1));
                }
                Err(x) => println!("  {x}"),
            }
        }
        println!("  fk {:?} {:?}", steps, e);
        // self calibration
        let mut set = vec![];
        let err: [f64; 8] = std::array::from_fn(|i| 1e-3 * ((i * 7 % 5) as f64 - 2.0) / 2.0);
        for n in 0..200 {
            let p = motion(n as f64 * 0.0613, reach(&g), 0.6);
            let l = g.lengths(&p);
            set.push(std::array::from_fn(|i| {
                let m = g.metres_per_count[i].abs();
                ((l[i] + err[i]) / m).floor() * m + 0.5 * m
            }));
        }
        println!("  self {:?}", self_calibrate(&g, &set));
        println!("  true {:?}", err.map(|e| -e));
        let _ = Vector3::<f64>::zeros();
    }
}
