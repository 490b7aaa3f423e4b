//! Raw pairs: `bp rectify`, and `bp match --rectify` for one pair and for videos.

use std::fs;

use super::folder::{Folder, HEIGHT, MATCH, WIDTH};

/// The centre of the images.
const CENTRE: [usize; 2] = [WIDTH as usize / 2, HEIGHT as usize / 2];

/// Cameras with lenses and this centre, one turned a little.
pub(crate) fn calibration(folder: &Folder, [x, y]: [usize; 2]) {
    let focal = 50 * x / CENTRE[0];
    let camera = format!("[{focal}, 0, {x}, 0, {focal}, {y}, 0, 0, 1]");
    let matrix = |name: &str, data: &str| {
        format!("{name}: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {data}\n")
    };
    let text = [
        "%YAML:1.0\n---\n".to_owned(),
        matrix("M1", &camera),
        matrix("M2", &camera),
        "D1: [-0.05, 0.01, 0., 0., 0.]\nD2: [-0.04, 0.01, 0., 0., 0.]\n".to_owned(),
        matrix("R", "[1., -0.02, 0., 0.02, 1., 0., 0., 0., 1.]"),
        "T: [-100., 1., 0.5]\n".to_owned(),
    ];
    fs::write(folder.path("raw.yml"), text.concat()).unwrap();
}

#[test]
fn one_step_two_steps_and_a_video_give_the_same_maps() {
    let folder = Folder::new();
    calibration(&folder, CENTRE);
    let made = folder.run("rectify left.png right.pgm --calib raw.yml --output made");
    assert_eq!(made.status.code(), Some(0));
    let two = "match made/left.png made/right.png --calib made/calib.txt --labels 12 -o two.npy --depth two.depth.npy";
    assert_eq!(folder.run(two).status.code(), Some(0));
    let one = format!("{MATCH} one.npy --calib raw.yml --rectify --depth one.depth.npy --points one.ply");
    assert_eq!(folder.run(&one).status.code(), Some(0));
    for frame in 0..2 {
        fs::copy(folder.path("left.png"), folder.path(&format!("l{frame}.png"))).unwrap();
        fs::copy(folder.path("right.pgm"), folder.path(&format!("r{frame}.pgm"))).unwrap();
    }
    let video = "match --video l%d.png r%d.pgm --labels 12 --output out --format npy --calib raw.yml --also depth";
    assert_eq!(folder.json(&format!("{video} --rectify --json"))["done"], 2);
    let bytes = |name: &str| fs::read(folder.path(name)).unwrap();
    for name in ["two.npy", "out/0.npy", "out/1.npy"] {
        assert!(bytes(name) == bytes("one.npy"), "{name}");
    }
    assert!(bytes("out/1.depth.npy") == bytes("one.depth.npy") && bytes("two.depth.npy") == bytes("one.depth.npy"));
    // A batch that is repeated does nothing; with another calibration it begins again.
    assert_eq!(folder.json(&format!("{video} --rectify --json"))["skipped"], 2);
    let changed = fs::read_to_string(folder.path("raw.yml")).unwrap().replace("-0.05", "-0.06");
    fs::write(folder.path("raw.yml"), changed).unwrap();
    assert_eq!(folder.json(&format!("{video} --rectify --json"))["skipped"], 0);
}

#[test]
fn what_cannot_be_rectified_is_refused_in_words() {
    let folder = Folder::new();
    calibration(&folder, CENTRE);
    fs::write(folder.path("calib.txt"), "cam0=[50 0 20; 0 50 12; 0 0 1]\ndoffs=0\nbaseline=60\n").unwrap();
    fs::write(folder.path("odd.yml"), "a: [1, 2]\n").unwrap();
    folder.fails(&format!("{MATCH} a.pfm --rectify"), 2, &["--calib"]);
    folder.fails(&format!("{MATCH} a.pfm --depth d.pfm --calib raw.yml"), 3, &["raw.yml", "before rectification"]);
    folder.fails(&format!("{MATCH} a.pfm --rectify --calib calib.txt"), 3, &["calib.txt", "before rectification"]);
    folder.fails("rectify left.png right.pgm --calib odd.yml -o out", 3, &["odd.yml", "M1, D1", "OpenCV"]);
    folder.fails("rectify left.png right.pgm --calib none.yml -o out", 3, &["none.yml"]);
    folder.fails("rectify left.png right.pgm --calib raw.yml --calib raw.yml --calib raw.yml -o out", 3, &["two"]);
    fs::create_dir(folder.path("here")).unwrap();
    fs::copy(folder.path("left.png"), folder.path("here/left.png")).unwrap();
    folder.fails("rectify here/left.png here/left.png --calib raw.yml -o here", 2, &["here", "would be overwritten"]);
}
