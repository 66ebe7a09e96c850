//! Pictures of what nodes show: who is asked, what comes, and what is refused of those who answer as they like.

use crate::support::{
    FORGIVING, PATIENCE, frame, join, key, must, options, proved_hello, raw_config, raw_connection,
    say, server_with, wait_for,
};
use std::time::{Duration, Instant};
use taut_link::{
    ClientLink, ClientOptions, NodePicture, PICTURE_PATIENCE, PictureAnswer, Role, ServerLink,
    ServerOptions, ShownPicture,
};
use taut_proto::{
    ControlMessage, PROTOCOL_VERSION,
    control::{Hello, LENGTH_BYTES, NoPicture, Offers, PictureHeader},
    picture::{MAX_PICTURE_BYTES, MAX_PICTURE_EDGE},
    proof::{Claim, Grant},
};
use tokio::{runtime::Handle, task::spawn_blocking, time::sleep};

async fn server() -> ServerLink {
    server_with(ServerOptions {
        idle_timeout: FORGIVING,
        // Those who only answer say nothing on the hot plane.
        node_timeout: Duration::from_secs(60),
        ..ServerOptions::loopback(key('a'))
    })
    .await
}

/// All answers, by the nodes' names.
async fn asked(server: &ServerLink) -> Vec<PictureAnswer> {
    let answers = server.picture_asker(Handle::current()).ask();
    let collect = move || answers.iter().collect::<Vec<_>>();
    let mut all = must(spawn_blocking(collect).await);
    all.sort_by(|a, b| a.node.cmp(&b.node));
    all
}

async fn node(server: &ServerLink, name: &str, pictures: bool) -> ClientLink {
    join(ClientOptions {
        pictures,
        ..options(server, Role::Render, name)
    })
    .await
}

fn shown(screen: &str, bytes: usize) -> ShownPicture {
    ShownPicture {
        screen: screen.to_owned(),
        shown_ns: 1,
        size: (64, 48),
        png: (0..bytes).map(|i| (i * 7) as u8).collect(),
    }
}

/// Answers the next question as a frame loop does.
async fn answer_next(link: &ClientLink, shown: taut_link::Shown) {
    let ask = wait_for("a question", || link.take_picture_ask()).await;
    assert_eq!(ask.longest_edge(), MAX_PICTURE_EDGE);
    ask.answer(shown);
}

fn why(answer: &PictureAnswer) -> &str {
    match &answer.pictures {
        Err(why) => why,
        Ok(pictures) => panic!("{} pictures of {}", pictures.len(), answer.node),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nodes_answer_with_all_their_pictures_and_an_older_one_is_named() {
    let server = server().await;
    let (front, table) = (
        node(&server, "front", true).await,
        node(&server, "table", true).await,
    );
    let _old = node(&server, "wall", false).await;
    let _watcher = join(options(&server, Role::Observer, "watcher")).await;
    let pictures = vec![shown("left-left", 300_000), shown("left-right", 1)];
    let (answers, (), ()) = tokio::join!(
        asked(&server),
        answer_next(&front, Ok(pictures.clone())),
        answer_next(&table, Err("its windows are hidden".to_owned())),
    );
    let names: Vec<&str> = answers.iter().map(|answer| answer.node.as_str()).collect();
    assert_eq!(
        names,
        ["front", "table", "wall"],
        "an observer is not asked"
    );
    let came: &Vec<NodePicture> = must(answers[0].pictures.as_ref());
    assert_eq!(came.len(), 2);
    for (came, sent) in came.iter().zip(&pictures) {
        assert_eq!(came.screen.raw(), sent.screen);
        assert_eq!((came.size, &came.png), (sent.size, &sent.png));
    }
    assert_eq!(why(&answers[1]), "its windows are hidden");
    assert!(why(&answers[2]).contains("older taut"), "{answers:?}");
    // Everybody is in still, and the next question is answered, too.
    let (answers, ()) = tokio::join!(asked(&server), answer_next(&front, Ok(pictures)));
    assert!(answers[0].pictures.is_ok(), "{answers:?}");
    assert!(why(&answers[1]).contains("showed no frame"), "{answers:?}");
    assert_eq!(server.clients().len(), 4);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_does_not_send_what_the_server_would_refuse() {
    let server = server().await;
    let front = node(&server, "front", true).await;
    let large = shown("left", MAX_PICTURE_BYTES as usize + 1);
    let (answers, ()) = tokio::join!(asked(&server), answer_next(&front, Ok(vec![large])));
    assert!(why(&answers[0]).contains("at most 5242880"), "{answers:?}");
    let many = (0..17).map(|_| shown("left", 10)).collect();
    let (answers, ()) = tokio::join!(asked(&server), answer_next(&front, Ok(many)));
    assert!(why(&answers[0]).contains("17 pictures"), "{answers:?}");
    let (answers, ()) = tokio::join!(asked(&server), async {
        drop(wait_for("a question", || front.take_picture_ask()).await);
    });
    assert!(why(&answers[0]).contains("busy"), "dropped: {answers:?}");
}

/// A node that is in and answers as it likes.
async fn stranger(server: &ServerLink, name: &str) -> quinn::Connection {
    let connection = raw_connection(server.quic_addr(), raw_config(server.pin())).await;
    let claim = Claim {
        role: Role::Render,
        node: name,
        grant: Grant::Master,
    };
    let hello = Hello {
        offers: Offers::PICTURES,
        ..proved_hello(&connection, claim)
    };
    let (send, mut recv) = say(&connection, &frame(&ControlMessage::Hello(hello))).await;
    let mut length = [0; LENGTH_BYTES];
    must(recv.read_exact(&mut length).await);
    tokio::spawn(async move {
        let _control = (send, recv);
        std::future::pending::<()>().await;
    });
    connection
}

fn header(width: u16, length: u32, more: bool) -> ControlMessage {
    ControlMessage::PictureHeader(PictureHeader {
        screen: "front".into(),
        shown_ns: 1,
        width,
        height: 1,
        length,
        more,
    })
}

/// The frame of a header with other numbers than an honest end can write.
fn bent(at: usize, with: &[u8]) -> Vec<u8> {
    let mut bytes = frame(&header(8, 4, false));
    // Prefix, name with its length, time.
    let begin = LENGTH_BYTES + 4 + 2 + "front".len() + 8 + at;
    bytes[begin..begin + with.len()].copy_from_slice(with);
    bytes
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_a_hostile_node_sends_is_refused_and_named_and_ends_with_the_question() {
    let server = server().await;
    let connection = stranger(&server, "left").await;
    let endless = [frame(&header(8, 4, true)), vec![0; 4]].concat().repeat(40);
    let none = ControlMessage::NoPicture(NoPicture {
        reason: "\u{1b}[2J".into(),
    });
    for (what, sent, expected) in [
        (
            "more bytes than a picture has",
            bent(4, &u32::MAX.to_le_bytes()),
            "out of its range",
        ),
        (
            "no bytes",
            bent(4, &0_u32.to_le_bytes()),
            "out of its range",
        ),
        (
            "a wider picture than was asked for",
            bent(0, &1281_u16.to_le_bytes()),
            "out of its range",
        ),
        (
            "fewer bytes than it says",
            [frame(&header(8, 5_000_000, false)), vec![1; 100]].concat(),
            "100 of 5000000",
        ),
        ("pictures without end", endless, "more than 16 pictures"),
        (
            "another message",
            frame(&ControlMessage::Bye(taut_proto::control::Bye {
                reason: "x".into(),
            })),
            "it answered with Bye",
        ),
        ("nothing", Vec::new(), "no whole picture"),
        ("a frame of 4 GiB", vec![0xff; 64], "no picture"),
        (
            "a frame of the largest size",
            65_536_u32.to_le_bytes().to_vec(),
            "no picture",
        ),
        ("a sentence that clears the terminal", frame(&none), "[2J"),
    ] {
        let answering = async {
            let (mut send, _recv) = must(connection.accept_bi().await);
            let _ = send.write_all(&sent).await; // stopped in between
            let _ = send.finish();
            let _ = send.stopped().await;
        };
        let (answers, ()) = tokio::join!(asked(&server), answering);
        assert_eq!(answers.len(), 1);
        let why = why(&answers[0]);
        assert!(why.contains(expected), "{what}: {why}");
        assert!(!why.contains('\u{1b}'), "{what}: {why:?}");
    }
    assert_eq!(server.clients().len(), 1, "it is in still");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_dribbles_is_given_up_and_keeps_no_other_waiting_longer() {
    let server = server().await;
    let connection = stranger(&server, "left").await;
    let front = node(&server, "front", true).await;
    let begun = Instant::now();
    let dribbling = async {
        let (mut send, _recv) = must(connection.accept_bi().await);
        let mut bytes = frame(&header(8, 1000, false));
        bytes.extend(vec![0; 1000]);
        for byte in bytes {
            if send.write_all(&[byte]).await.is_err() {
                return; // the server has had enough
            }
            sleep(Duration::from_millis(100)).await;
        }
        panic!("the server waits for ever");
    };
    let (answers, (), ()) = tokio::join!(
        asked(&server),
        dribbling,
        answer_next(&front, Ok(vec![shown("front", 100)])),
    );
    assert!(answers[0].pictures.is_ok());
    assert!(
        why(&answers[1]).contains("did not answer within 10 s"),
        "{answers:?}"
    );
    assert!(begun.elapsed() < PICTURE_PATIENCE + PATIENCE);
    assert_eq!(PROTOCOL_VERSION, 4, "the layout grows within it");
}
