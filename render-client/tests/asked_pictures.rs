//! Pictures that the server asks a drawing node for: what they show, how large they are, and that drawing goes on.
//! Left out, said aloud, without a graphics adapter.

use crate::live::{Server, barrier, can_draw, start, wait_for};

use image::RgbImage;
use taut_link::{NodePicture, PictureAnswer};
use taut_proto::barrier::Swap;
use taut_proto::scene::Stereo;

/// The pictures of each node that is in.
fn asked(server: &Server) -> Vec<PictureAnswer> {
    let handle = server.runtime.handle().clone();
    let mut all: Vec<_> = server.link.picture_asker(handle).ask().iter().collect();
    all.sort_by(|a, b| a.node.cmp(&b.node));
    all
}

fn decoded(picture: &NodePicture) -> RgbImage {
    let image = image::load_from_memory(&picture.png)
        .expect("a PNG")
        .to_rgb8();
    let (width, height) = image.dimensions();
    assert_eq!(
        (width, height),
        (picture.size.0.into(), picture.size.1.into())
    );
    image
}

/// Mean difference of the channels, of 255.
fn difference(one: &RgbImage, other: &RgbImage) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let sum: u64 = one
        .iter()
        .zip(other.iter())
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    sum as f64 / one.as_raw().len() as f64
}

#[test]
fn a_node_sends_what_it_shows_of_each_screen_and_eye() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let (mut both, mut pair) = (server.args("both"), server.args("pair"));
    (both.out, both.fps) = (Some(server.pictures()), Some(5.0));
    pair.stereo = None;
    let nodes = [start(both), start(pair)];
    wait_for("both draw", || {
        server.frames("both") > 2 && server.frames("pair") > 2
    });
    let answers = asked(&server);
    assert_eq!(answers.len(), 2);
    let of = |place: usize| answers[place].pictures.as_ref().expect("pictures");
    let names = |place: usize| {
        of(place)
            .iter()
            .map(|p| p.screen.raw().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(names(0), ["wall", "table"]);
    assert_eq!(names(1), ["wall-left", "wall-right"]);
    // As the frames that it writes by itself: the body has moved by a centimetre at most.
    let written = image::open(server.pictures().join("both-table-00002.png"));
    let written = written.expect("a picture").to_rgb8();
    let table = decoded(&of(0)[1]);
    assert!(
        difference(&table, &written) < 3.0,
        "{}",
        difference(&table, &written)
    );
    let wall = decoded(&of(0)[0]);
    assert!(difference(&table, &wall) > 3.0, "each its own screen");
    let eyes = [decoded(&of(1)[0]), decoded(&of(1)[1])];
    assert!(difference(&eyes[0], &eyes[1]) > 0.1, "each its own eye");
    assert!(of(0)[0].age.as_secs_f64() < 10.0, "{:?}", of(0)[0].age);
    // Asked again and again, it draws on.
    let before = server.frames("pair");
    for _ in 0..3 {
        assert!(asked(&server).iter().all(|answer| answer.pictures.is_ok()));
    }
    wait_for("it draws on", || server.frames("pair") > before);
    server.stop();
    for node in nodes {
        node.join().expect("no panic").expect("ends in good order");
    }
}

#[test]
fn a_large_picture_is_scaled_down_and_keeps_both_eyes_and_its_barrier() {
    if !can_draw() {
        return;
    }
    let server = Server::start_with(Some(barrier(Swap::Immediate)));
    let mut args = server.args("both");
    (args.width, args.height) = (Some(2000), Some(300));
    args.stereo = Some(Stereo::SideBySide);
    let node = start(args);
    wait_for("it draws", || server.frames("both") > 2);
    let answers = asked(&server);
    let pictures = answers[0].pictures.as_ref().expect("pictures");
    for picture in pictures {
        let (width, height) = picture.size;
        assert_eq!(width, 1280, "{:?}", picture.size);
        let image = decoded(picture);
        assert!(
            image.pixels().any(|pixel| *pixel != *image.get_pixel(0, 0)),
            "not empty"
        );
        let half = |x| image::imageops::crop_imm(&image, x, 0, 640, height.into()).to_image();
        let apart = difference(&half(0), &half(640));
        assert!(
            (0.05..60.0).contains(&apart),
            "two eyes of one scene: {apart}"
        );
    }
    server.stop();
    node.join().expect("no panic").expect("ends in good order");
}
