//! The surfaces of the six scenes, in pixels of the full-size left image. Shared pieces come first.

use super::render::World;
use super::surface::{Folds, Profile, Relief, Strip, Surface};
use super::texture::{Paint, Pattern, uniform};

type Ramp = [[u8; 3]; 3];

const SKIN: Ramp = [[205, 158, 128], [222, 176, 146], [236, 194, 166]];
const INK: Ramp = [[34, 26, 24], [48, 36, 32], [66, 50, 44]];
const CLAY: Ramp = [[146, 84, 58], [176, 104, 74], [198, 126, 94]];
const LEAF: Ramp = [[44, 70, 40], [86, 122, 66], [150, 176, 108]];
const PLASTER: Ramp = [[168, 164, 152], [184, 180, 168], [198, 195, 184]];
const WOOD: Ramp = [[92, 62, 38], [150, 108, 68], [196, 156, 106]];
const IVORY: Ramp = [[206, 200, 186], [222, 217, 204], [236, 232, 222]];
const PAGES: Ramp = [[150, 140, 118], [196, 186, 162], [226, 218, 198]];

/// The scene of this index in `NAMES`.
pub(super) fn world(index: usize) -> World {
    [doll, leaves, cloth, pots, bowling, books][index]()
}

fn paint(ramp: Ramp, pattern: Pattern, grain: f64, seed: u32) -> Paint {
    Paint { ramp, pattern, grain, seed }
}

/// A surface behind all others. Its strip only provides coordinates, since the world treats it as endless.
fn backdrop(relief: Relief, paint: Paint) -> Surface {
    Surface::new(Strip::new([0.0, 0.0], [0.0, 600.0], 1000.0, Profile::Bar), relief, paint)
}

/// A paraboloid seen from its top.
fn ball(centre: [f64; 2], radii: [f64; 2], level: f64, bulge: f64, paint: Paint) -> Surface {
    Surface::new(Strip::ellipse(centre, radii), Relief { level, bulge, ..Relief::default() }, paint)
}

/// A level plane from row `top` down past the image, nearer towards the bottom.
fn ground(top: f64, level: f64, slant: [f64; 2], paint: Paint) -> Surface {
    let strip = Strip::new([0.0, top], [0.0, top + 600.0], 2000.0, Profile::Bar);
    Surface::new(strip, Relief { level, slant, ..Relief::default() }, paint)
}

/// A folded leaf whose disparity goes from `levels[0]` at its foot to `levels[1]` at its tip.
fn leaf(from: [f64; 2], to: [f64; 2], half_width: f64, bend: f64, levels: [f64; 2], seed: u32) -> Surface {
    let strip = Strip::new(from, to, half_width, Profile::Leaf).bent(bend);
    let relief =
        Relief { level: levels[0], rise: levels[1] - levels[0], crease: 0.25 * half_width, ..Relief::default() };
    Surface::new(strip, relief, paint(LEAF, Pattern::Veins { period: 9.0 }, 7.0, seed))
}

/// A doll in front of a map, on a blanket: round, weakly textured limbs on a rich background.
fn doll() -> World {
    let map = [[58, 74, 96], [190, 176, 136], [128, 72, 56]];
    let blanket = [[70, 62, 88], [128, 116, 132], [186, 172, 166]];
    let backdrop = backdrop(
        Relief { level: 21.8, slant: [-0.015, 0.0], ..Relief::default() },
        paint(map, Pattern::Contours { wavelength: 150.0 }, 10.0, 10),
    );
    let blanket = paint(blanket, Pattern::Weave { pitch: 5.0, print: 60.0 }, 6.0, 11);
    let mut objects = vec![ground(410.0, 21.8, [-0.015, 0.2], blanket)];
    objects.extend(doll_body());
    objects.extend(doll_face());
    let toy = [[40, 86, 120], [62, 120, 160], [210, 190, 90]];
    objects.push(ball(
        [515.0, 432.0],
        [58.0, 58.0],
        32.0,
        15.0,
        paint(toy, Pattern::Stripes { period: 46.0 }, 1.5, 12),
    ));
    let brick = Strip::new([66.0, 352.0], [88.0, 452.0], 52.0, Profile::Bar);
    let wood = paint(WOOD, Pattern::Planks { width: 26.0 }, 4.0, 13);
    objects.push(Surface::new(brick, Relief { level: 34.0, slant: [-0.12, 0.02], ..Relief::default() }, wood));
    World { backdrop, objects }
}

fn doll_body() -> Vec<Surface> {
    const LIMB: Profile = Profile::Turned(&[0.55, 0.9, 0.95, 0.88, 0.85, 0.9, 1.0, 0.9, 0.3]);
    let striped = paint([[176, 60, 64], [196, 116, 112], [226, 214, 200]], Pattern::Stripes { period: 26.0 }, 4.0, 20);
    let skin = paint(SKIN, Pattern::Mottle { across: 70.0, along: 70.0 }, 1.2, 21);
    let part = |from, to, half_width, profile, level, rise, bulge, paint| {
        let relief = Relief { level, rise, bulge, ..Relief::default() };
        Surface::new(Strip::new(from, to, half_width, profile).sagging(8.0), relief, paint)
    };
    let torso = Profile::Turned(&[0.45, 0.72, 0.8, 0.84, 0.92, 1.0, 0.98, 0.7]);
    vec![
        part([300.0, 208.0], [300.0, 448.0], 84.0, torso, 38.0, 4.0, 15.0, striped),
        part([236.0, 246.0], [140.0, 352.0], 25.0, LIMB, 44.0, 8.0, 6.0, skin),
        part([364.0, 246.0], [462.0, 330.0], 25.0, LIMB, 42.0, 12.0, 6.0, skin),
        part([262.0, 420.0], [172.0, 502.0], 34.0, LIMB, 48.0, 15.3, 8.0, skin),
        part([338.0, 420.0], [436.0, 506.0], 34.0, LIMB, 48.0, 15.3, 8.0, skin),
    ]
}

fn doll_face() -> Vec<Surface> {
    let skin = paint(SKIN, Pattern::Mottle { across: 90.0, along: 90.0 }, 1.2, 22);
    let ink = paint(INK, Pattern::Mottle { across: 12.0, along: 12.0 }, 3.0, 23);
    let hat =
        paint([[60, 84, 130], [84, 112, 158], [150, 170, 196]], Pattern::Weave { pitch: 6.0, print: 30.0 }, 5.0, 24);
    let cone = Profile::Turned(&[0.1, 0.4, 0.62, 0.8, 0.92, 1.0]);
    let cap = Strip::new([300.0, 16.0], [300.0, 88.0], 66.0, cone).sagging(14.0);
    let mouth = Strip::new([280.0, 190.0], [320.0, 190.0], 2.6, Profile::Round).bent(-7.0);
    vec![
        ball([300.0, 146.0], [70.0, 76.0], 47.0, 16.0, skin),
        Surface::new(cap, Relief { level: 52.0, bulge: 11.0, ..Relief::default() }, hat),
        ball([275.0, 134.0], [8.0, 9.0], 61.2, 1.0, ink),
        ball([325.0, 134.0], [8.0, 9.0], 61.2, 1.0, ink),
        ball([300.0, 158.0], [12.0, 12.0], 63.0, 3.0, skin),
        Surface::new(mouth, Relief { level: 59.5, ..Relief::default() }, ink),
    ]
}

/// A plant of many narrow leaves in front of a printed cloth: occlusions everywhere.
fn leaves() -> World {
    let print = [[46, 44, 60], [138, 116, 104], [214, 200, 176]];
    let backdrop = backdrop(
        Relief { level: 21.5, slant: [0.004, 0.01], ..Relief::default() },
        paint(print, Pattern::Weave { pitch: 5.0, print: 30.0 }, 12.0, 30),
    );
    let pot = Strip::new([330.0, 446.0], [330.0, 620.0], 120.0, Profile::Bar).sagging(16.0);
    let clay = paint(CLAY, Pattern::Mottle { across: 80.0, along: 24.0 }, 2.0, 31);
    let mut objects = vec![Surface::new(pot, Relief { level: 44.0, bulge: 22.0, ..Relief::default() }, clay)];
    objects.extend((0..LEAVES).map(plant_leaf));
    World { backdrop, objects }
}

const LEAVES: i32 = 48;

/// One of the leaves that spread from the pot, those in the back first.
fn plant_leaf(i: i32) -> Surface {
    let random = |j: i32, low: f64, high: f64| low + (high - low) * uniform(32, i, j);
    let depth = f64::from(i) / f64::from(LEAVES - 1);
    let foot = [330.0 + random(0, -70.0, 70.0), 440.0 + 40.0 * depth];
    let tip = [random(1, -30.0, 690.0), random(2, -30.0, 150.0) + 340.0 * depth * random(3, 0.1, 1.0)];
    let level = 40.0 + 26.0 * depth;
    let rise = (random(4, -14.0, 2.0) + 46.0 * depth).min(0.25 * (foot[1] - tip[1]).abs());
    leaf(foot, tip, random(5, 11.0, 21.0), random(6, -40.0, 40.0), [level, level + rise], 100 + i as u32)
}

/// One cloth in deep folds with a flap in front of it: smooth, all fine texture.
fn cloth() -> World {
    let dye = [[92, 62, 50], [156, 118, 92], [214, 184, 148]];
    let deep = Folds { amplitude: 33.0, wavelength: [260.0, 520.0], lean: 0.35, seed: 40 };
    let small = Folds { amplitude: 4.5, wavelength: [70.0, 190.0], lean: 0.5, seed: 41 };
    let backdrop = backdrop(
        Relief { level: 49.0, slant: [0.0, 0.02], folds: vec![deep, small], ..Relief::default() },
        paint(dye, Pattern::Weave { pitch: 4.0, print: 48.0 }, 12.0, 42),
    );
    let hem = Profile::Turned(&[0.9, 1.0, 0.86, 0.94, 0.8, 0.9, 0.7, 0.76, 0.5]);
    let flap = Strip::new([500.0, -40.0], [430.0, 400.0], 100.0, hem).bent(24.0).sagging(18.0);
    let relief = Relief { level: 66.0, rise: 9.0, bulge: 6.0, folds: vec![small], ..Relief::default() };
    let lining =
        paint([[60, 66, 92], [120, 118, 132], [196, 186, 176]], Pattern::Weave { pitch: 5.0, print: 40.0 }, 7.0, 43);
    World { backdrop, objects: vec![Surface::new(flap, relief, lining)] }
}

/// Flower pots of bare clay in front of plaster: large areas almost without texture.
fn pots() -> World {
    let plaster = paint(PLASTER, Pattern::Mottle { across: 90.0, along: 90.0 }, 4.5, 50);
    let backdrop = backdrop(Relief { level: 8.05, slant: [-0.01, 0.0], ..Relief::default() }, plaster);
    let boards = paint(WOOD, Pattern::Planks { width: 74.0 }, 7.0, 51);
    let mut objects = vec![ground(320.0, 8.05, [-0.01, 0.3], boards)];
    objects.extend(pot(335.0, [236.0, 378.0], 56.0, 24.0, 11.0, 52));
    objects.extend(pot(452.0, [250.0, 430.0], 80.0, 38.0, 15.0, 53));
    objects.extend(pot(186.0, [276.0, 490.0], 100.0, 54.0, 19.0, 54));
    objects.extend(pot(584.0, [352.0, 536.0], 84.0, 72.0, 16.0, 55));
    objects.extend(sprout([335.0, 232.0], 30.0, 56));
    objects.extend(sprout([186.0, 272.0], 62.0, 57));
    World { backdrop, objects }
}

/// A tapering pot with a rim and a dark opening; `rows` are its top and bottom.
fn pot(x: f64, rows: [f64; 2], half_width: f64, level: f64, bulge: f64, seed: u32) -> [Surface; 3] {
    const TAPER: Profile = Profile::Turned(&[1.0, 0.95, 0.9, 0.84, 0.77, 0.7]);
    let sag = 0.16 * half_width;
    let clay = paint(CLAY, Pattern::Mottle { across: 70.0, along: 40.0 }, 5.0, seed);
    let dark = paint([[60, 40, 32], [70, 48, 38], [84, 58, 46]], Pattern::Plain, 2.0, seed);
    let turned = |top: f64, bottom: f64, half_width: f64, profile, level| {
        let strip = Strip::new([x, top], [x, bottom], half_width, profile).sagging(sag);
        Surface::new(strip, Relief { level, bulge, ..Relief::default() }, clay)
    };
    [
        turned(rows[0], rows[1], half_width, TAPER, level),
        turned(rows[0], rows[0] + 0.3 * half_width, 1.1 * half_width, Profile::Bar, level + 2.0),
        ball([x, rows[0]], [1.1 * half_width, sag], level, 0.0, dark),
    ]
}

/// Thin stems with a few leaves.
fn sprout(foot: [f64; 2], level: f64, seed: u32) -> Vec<Surface> {
    let stalk = |i: i32| {
        let random = |j: i32, low: f64, high: f64| low + (high - low) * uniform(seed, i, j);
        let tip = [foot[0] + random(0, -90.0, 90.0), foot[1] - random(1, 90.0, 190.0)];
        let bend = random(2, -18.0, 18.0);
        let stem = Strip::new(foot, tip, 2.8, Profile::Bar).bent(bend);
        let green = paint(LEAF, Pattern::Plain, 6.0, seed);
        let top = level + random(3, -6.0, 8.0);
        let relief = Relief { level, rise: top - level, ..Relief::default() };
        let end = [tip[0] + random(4, -60.0, 60.0), tip[1] - random(5, 20.0, 70.0)];
        [Surface::new(stem, relief, green), leaf(tip, end, random(6, 12.0, 20.0), 6.0, [top, top + 4.0], seed)]
    };
    (0..5).flat_map(stalk).collect()
}

/// A large ball and pins on a lane: curved, shiny-smooth objects with weak texture.
fn bowling() -> World {
    let grey = [[96, 104, 116], [116, 124, 136], [138, 146, 156]];
    let wall = paint(grey, Pattern::Mottle { across: 120.0, along: 60.0 }, 3.6, 60);
    let backdrop = backdrop(Relief { level: 19.5, slant: [0.01, 0.0], ..Relief::default() }, wall);
    let lane = paint(WOOD, Pattern::Planks { width: 44.0 }, 5.0, 61);
    let mut objects = vec![ground(250.0, 19.5, [0.01, 0.2], lane)];
    let places = [(330.0, 320.0), (425.0, 324.0), (525.0, 330.0), (380.0, 372.0), (480.0, 380.0), (430.0, 440.0)];
    for (i, (x, bottom)) in places.into_iter().enumerate() {
        let scale = 0.8 + 0.0022 * (bottom - 320.0);
        objects.extend(pin(
            [x, bottom - 190.0 * scale],
            [x, bottom],
            scale,
            19.5 + 0.2 * (bottom - 255.0),
            62 + i as u32,
        ));
    }
    objects.extend(pin([648.0, 424.0], [494.0, 472.0], 1.0, 66.0, 70));
    objects.extend(bowling_ball([178.0, 372.0], 112.0, 67.0, 30.0));
    World { backdrop, objects }
}

/// A marbled ball with three finger holes.
fn bowling_ball(centre: [f64; 2], radius: f64, level: f64, bulge: f64) -> [Surface; 4] {
    let marble = paint([[32, 38, 92], [42, 50, 110], [54, 66, 130]], Pattern::Contours { wavelength: 110.0 }, 2.5, 71);
    let hole = |dx: f64, dy: f64| {
        let level = level + 2.0 + bulge * (1.0 - (dx * dx + dy * dy) / (radius * radius));
        ball([centre[0] + dx, centre[1] + dy], [11.0, 11.0], level, 0.0, paint(INK, Pattern::Plain, 2.0, 72))
    };
    let whole = ball(centre, [radius, radius], level, bulge, marble);
    [whole, hole(-18.0, -42.0), hole(18.0, -46.0), hole(4.0, -6.0)]
}

/// A pin with a red band around its neck.
fn pin(top: [f64; 2], bottom: [f64; 2], scale: f64, level: f64, seed: u32) -> [Surface; 2] {
    const SHAPE: Profile = Profile::Turned(&[0.1, 0.46, 0.5, 0.42, 0.38, 0.46, 0.68, 0.92, 1.0, 0.96, 0.82, 0.6]);
    let (bulge, half_width) = (11.0 * scale, 36.0 * scale);
    let strip = Strip::new(top, bottom, half_width, SHAPE).sagging(5.0 * scale);
    let at = |t: f64| [0, 1].map(|i| top[i] + t * (bottom[i] - top[i]));
    let band = Strip::new(at(0.31), at(0.37), 0.4 * half_width, Profile::Bar).sagging(5.0 * scale);
    let ivory = paint(IVORY, Pattern::Mottle { across: 60.0, along: 60.0 }, 2.5, seed);
    let red = paint([[150, 30, 36], [168, 40, 44], [186, 54, 56]], Pattern::Plain, 3.0, seed);
    [
        Surface::new(strip, Relief { level, bulge, ..Relief::default() }, ivory),
        Surface::new(band, Relief { level: level + 0.5, bulge: 0.18 * bulge, ..Relief::default() }, red),
    ]
}

/// Books standing, leaning and lying: slanted planes with print and plain margins.
fn books() -> World {
    let shelf = paint(
        [[74, 66, 60], [120, 110, 100], [164, 154, 142]],
        Pattern::Mottle { across: 30.0, along: 140.0 },
        5.0,
        80,
    );
    let backdrop = backdrop(Relief { level: 4.5, slant: [0.008, 0.006], ..Relief::default() }, shelf);
    let table = paint(WOOD, Pattern::Planks { width: 90.0 }, 5.0, 81);
    let mut objects = vec![ground(380.0, 6.8, [0.008, 0.28], table)];
    let [navy, wine, sand, moss, rose, slate, gold] = COVERS;
    objects.extend(book([110.0, 40.0], [120.0, 400.0], 96.0, 20.0, [0.10, 0.02], navy, 82));
    objects.extend(book([330.0, 20.0], [300.0, 390.0], 92.0, 24.0, [-0.12, 0.03], sand, 83));
    objects.extend(book([560.0, 50.0], [530.0, 410.0], 110.0, 30.0, [0.16, 0.0], wine, 84));
    objects.extend(book([215.0, 130.0], [196.0, 440.0], 84.0, 48.0, [0.2, 0.04], moss, 85));
    objects.extend(book([452.0, 160.0], [420.0, 460.0], 80.0, 56.0, [-0.22, 0.05], rose, 86));
    objects.extend(book([640.0, 190.0], [668.0, 500.0], 78.0, 66.0, [-0.14, 0.05], slate, 87));
    objects.extend(book([100.0, 300.0], [330.0, 500.0], 90.0, 72.7, [0.04, 0.12], gold, 88));
    World { backdrop, objects }
}

const COVERS: [Ramp; 7] = [
    [[30, 40, 78], [96, 120, 150], [226, 220, 196]],
    [[104, 28, 36], [164, 92, 72], [238, 220, 180]],
    [[198, 178, 138], [140, 104, 76], [50, 40, 44]],
    [[46, 72, 52], [118, 138, 96], [228, 226, 190]],
    [[206, 150, 146], [150, 84, 104], [60, 40, 70]],
    [[70, 78, 86], [130, 140, 146], [232, 234, 230]],
    [[196, 150, 60], [130, 80, 50], [40, 36, 40]],
];

/// A cover, a trapezoid in perspective, and the edges of the pages on its right.
fn book(
    top: [f64; 2],
    bottom: [f64; 2],
    half_width: f64,
    level: f64,
    slant: [f64; 2],
    ramp: Ramp,
    seed: u32,
) -> [Surface; 2] {
    let strip = Strip::new(top, bottom, half_width, Profile::Turned(&[0.97, 1.0]));
    let relief = Relief { level, slant, ..Relief::default() };
    let cover = Surface::new(strip, relief, paint(ramp, Pattern::Cover, 2.5, seed));
    let thick = 14.0;
    let edge = strip.beside(half_width + thick - 5.0, thick);
    let level = cover.disparity(edge.from[0], edge.from[1]) - 4.0;
    let relief = Relief { level, slant: [slant[0] - 0.12, slant[1]], ..Relief::default() };
    [cover, Surface::new(edge, relief, paint(PAGES, Pattern::Mottle { across: 4.0, along: 90.0 }, 3.0, seed))]
}
