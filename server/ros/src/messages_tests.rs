use super::*;
use god_object::nalgebra::Quaternion;
use proptest::prelude::*;

/// The bytes by hand, from the alignment rules of CDR: each number at a multiple of its size, counted behind the four bytes of the encapsulation.
#[test]
fn a_pose_is_plain_cdr_with_numbers_at_multiples_of_their_size() {
    let pose = Pose::from_parts(
        Translation3::new(1.0, 2.0, 3.0),
        UnitQuaternion::new_unchecked(Quaternion::new(0.5, -0.5, 0.5, -0.5)),
    );
    let time = Duration::new(7, 9);
    let header = Header::new(time, "world").expect("seven seconds are not too many");
    let mut bytes = vec![99; 3];
    assert!(PoseStamped::new(header, &pose).encode(&mut bytes).is_ok());
    let mut expected = vec![0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 6, 0, 0, 0];
    expected.extend(b"world\0");
    expected.extend([0; 6]); // 18 bytes so far: the next multiple of 8 is 24
    for number in [1.0, 2.0, 3.0, -0.5, 0.5, -0.5, 0.5] {
        expected.extend(f64::to_le_bytes(number));
    }
    assert_eq!(bytes, expected);
}

#[test]
fn buttons_are_sixteen_numbers_and_there_are_no_axes() {
    let header = Header::new(Duration::ZERO, "device").expect("zero is not too many");
    let joy = Joy::new(header, 0x8001);
    assert!(joy.axes.is_empty());
    assert_eq!(joy.buttons[..2], [1, 0]);
    assert_eq!((joy.buttons[15], joy.buttons.len()), (1, 16));
}

#[test]
fn a_time_that_ros_cannot_say_is_none() {
    assert!(Header::new(Duration::from_secs(1 << 31), "world").is_none());
    assert!(Header::new(Duration::from_secs((1 << 31) - 1), "world").is_some());
}

#[test]
fn names_of_obstacles_become_names_of_ros() {
    assert_eq!(
        obstacle_frame(2, "upper plate/é"),
        "obstacle_2_upper_plate__"
    );
}

fn sent() -> (Vector6, Vec<u8>) {
    let wrench = Vector6::new(1.0, -2.0, 3.0, f64::NAN, 1e300, -0.0);
    let header = Header::new(Duration::new(7, 9), "tool0").expect("seven seconds");
    let mut bytes = Vec::new();
    assert!(
        WrenchStamped::new(header, &wrench)
            .encode(&mut bytes)
            .is_ok()
    );
    (wrench, bytes)
}

#[test]
fn a_wrench_comes_back_to_the_bit_in_both_byte_orders_and_cut_ones_do_not() {
    let (wrench, bytes) = sent();
    let bits = |of: &Vector6| of.map(f64::to_bits);
    let read = ReceivedWrench::decode(&bytes).expect("a wrench");
    assert_eq!((read.stamp, read.frame_id.as_str()), ((7, 9), "tool0"));
    assert_eq!(bits(&read.wrench), bits(&wrench));
    for cut in 0..bytes.len() {
        assert_eq!(ReceivedWrench::decode(&bytes[..cut]), None, "{cut}");
    }
    let mut long = bytes.clone();
    long.extend([0; 4]);
    assert_eq!(
        ReceivedWrench::decode(&long),
        None,
        "more than padding behind it"
    );
    // The same by hand, the highest byte first.
    let mut big = vec![0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 6];
    big.extend(b"tool0\0\0\0\0\0\0\0");
    for number in &wrench {
        big.extend(number.to_be_bytes());
    }
    let read = ReceivedWrench::decode(&big).expect("a wrench");
    assert_eq!((read.stamp, read.frame_id.as_str()), ((7, 9), "tool0"));
    assert_eq!(bits(&read.wrench), bits(&wrench));
}

proptest! {
    #[test]
    fn whatever_comes_is_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..600), at in 0_usize..80) {
        let _ = ReceivedWrench::decode(&bytes);
        let (_, mut damaged) = sent();
        let end = bytes.len().min(damaged.len().saturating_sub(at));
        let from = at.min(damaged.len());
        damaged[from..from + end].copy_from_slice(&bytes[..end]);
        let _ = ReceivedWrench::decode(&damaged);
    }
}

/// Name and fields of a definition: the type, whether it is a list of any length, and the field's name.
type Fields = Vec<(String, bool, String)>;

fn fields(definition: &str) -> Fields {
    let field = |line: &str| {
        let mut words = line.split(' ');
        let kind = words.next().expect("a type");
        let name = words.next().expect("a name");
        let (kind, is_list) = match kind.strip_suffix("[]") {
            Some(kind) => (kind, true),
            None => (kind, false),
        };
        (kind.to_owned(), is_list, name.to_owned())
    };
    definition.lines().map(field).collect()
}

/// REP 2011: numbers of the types as `type_description_interfaces/msg/FieldType` has them; a list of any length is 144 more.
fn described(name: &str, definition: &str) -> String {
    let fields = fields(definition).into_iter().map(|(kind, is_list, name)| {
        let number = match kind.as_str() {
            "int32" => 6,
            "uint32" => 7,
            "float32" => 10,
            "float64" => 11,
            "string" => 17,
            _ => 1,
        };
        let nested = match number {
            1 => kind.replace('/', "/msg/"),
            _ => String::new(),
        };
        format!(
            "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {}, \"capacity\": 0, \"string_capacity\": 0, \"nested_type_name\": \"{nested}\"}}}}",
            number + 144 * i32::from(is_list)
        )
    });
    let fields = fields.collect::<Vec<_>>().join(", ");
    format!("{{\"type_name\": \"{name}\", \"fields\": [{fields}]}}")
}

fn hash_of<M: Message>() -> String {
    let mut needs: Vec<(String, &str)> = M::NEEDS
        .iter()
        .map(|(name, definition)| (name.replace('/', "/msg/"), *definition))
        .collect();
    needs.sort();
    let needs: Vec<String> = needs
        .iter()
        .map(|(name, text)| described(name, text))
        .collect();
    let text = format!(
        "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
        described(M::NAME, M::DEFINITION),
        needs.join(", ")
    );
    let digest = ring::digest::digest(&ring::digest::SHA256, text.as_bytes());
    let hex: String = digest
        .as_ref()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    format!("RIHS01_{hex}")
}

#[test]
fn the_published_hashes_are_those_of_these_definitions() {
    assert_eq!(hash_of::<PoseStamped<'_>>(), PoseStamped::HASH);
    assert_eq!(hash_of::<TwistStamped<'_>>(), TwistStamped::HASH);
    assert_eq!(hash_of::<WrenchStamped<'_>>(), WrenchStamped::HASH);
    assert_eq!(hash_of::<Joy<'_>>(), Joy::HASH);
    assert_eq!(hash_of::<TfMessage<'_>>(), TfMessage::HASH);
}
