//! `program make` and `program check`.

mod support;

use std::fs;

use serde_json::Value;
use support::{Folder, printed};

#[test]
fn an_image_is_made_and_checked() {
    let folder = Folder::new();
    let (input, output) = (folder.file("firmware.bin"), folder.file("firmware.sbi"));
    fs::write(&input, b"123456789").unwrap();
    let make = |product: &str| {
        let words = ["program", "make", "--version", "1.2", "--product"];
        printed(&[&words[..], &[product, &input, &output]].concat(), 0)
    };
    let said = make("0x5033");
    let image = fs::read(&output).unwrap();
    assert_eq!(image.len(), 64 + 9);
    assert_eq!(&image[64..], b"123456789");
    let identification = u32::from_le_bytes(image[4..8].try_into().unwrap());
    let words = format!(
        "{output}: program 1.2 for product 0x5033, 9 bytes, software identification \
         0x{identification:08X}\n"
    );
    assert_eq!(said, words);
    assert_eq!(printed(&["program", "check", &output], 0), words);
    let json = printed(&["program", "check", "--json", &output], 0);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["version"], "1.2");
    assert_eq!(json["product"], 0x5033);
    assert_eq!(json["identification"], identification);
    assert_eq!(
        (&json["program_bytes"], &json["image_bytes"]),
        (&9.into(), &73.into())
    );
    // In decimal it is the same.
    assert_eq!(make("20531"), words);
}

#[test]
fn what_a_drive_would_refuse() {
    let folder = Folder::new();
    let (input, output) = (folder.file("firmware.bin"), folder.file("firmware.sbi"));
    fs::write(&input, b"123456789").unwrap();
    let words = ["program", "make", "--version", "1", "--product", "1"];
    printed(&[&words[..], &[&input, &output]].concat(), 0);
    let image = fs::read(&output).unwrap();
    let mut flipped = image.clone();
    flipped[70] ^= 1;
    for (bytes, says) in [
        (&image[..72], "too short: 72 bytes, the image has 73"),
        (
            &[&image[..], b"\n"].concat(),
            "too long: the image has 73 bytes",
        ),
        (&flipped, "checksum 0x"),
        (&[0; 100], "not a program image"),
    ] {
        fs::write(&output, bytes).unwrap();
        let said = printed(&["program", "check", &output], 1);
        assert!(
            said.starts_with(&format!("error: {output}: {says}")),
            "{said}"
        );
    }
}

#[test]
fn bad_input_is_named() {
    let folder = Folder::new();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.file(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let (good, empty) = (file("good", b"program"), file("empty", b""));
    let image = folder.file("image");
    let make = |version: &str, product: &str, input: &str, output: &str| {
        let words = [
            "program",
            "make",
            "--version",
            version,
            "--product",
            product,
        ];
        printed(&[&words[..], &[input, output]].concat(), 2)
    };
    let long = "x".repeat(33);
    for (said, says) in [
        (make("1", "5033h", &good, &image), "that is no product code"),
        (
            make("1", "0x100000000", &good, &image),
            "that is no product code",
        ),
        (make(&long, "1", &good, &image), "33 bytes, at most 32"),
        (make("", "1", &good, &image), "--version"),
        (make("1", "1", &empty, &image), "the file is empty"),
        (
            make("1", "1", "/nowhere/x", &image),
            "/nowhere/x: cannot be read",
        ),
        (
            make("1", "1", &good, "/nowhere/x"),
            "/nowhere/x: cannot be written",
        ),
        (
            printed(&["program", "check", "/nowhere/x"], 2),
            "/nowhere/x: cannot be read",
        ),
    ] {
        assert!(said.contains(says), "{said}");
    }
    assert!(!fs::exists(&image).unwrap());
    let words = ["program", "make", "--version", "1", "--product", "1"];
    printed(&[&words[..], &[&good, &image]].concat(), 0);
    let said = make("1", "1", &image, &folder.file("twice"));
    assert!(said.contains("that is an image already"), "{said}");
}
