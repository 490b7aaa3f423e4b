"""Rectification against OpenCV's, on calibrations in every format that is read."""
import subprocess
import sys

import numpy
import pytest

import bpstereo

cv2 = pytest.importorskip("cv2")

SIZE = (640, 480)


def rotation(rng, most):
    return cv2.Rodrigues(rng.uniform(-most, most, 3))[0]


class Rig:
    """Two cameras that differ in everything, as OpenCV describes them."""

    def __init__(self, seed, kind):
        rng = numpy.random.default_rng(seed)
        self.kind, self.rng = kind, rng
        # A fisheye sees more.
        focal = 300 if kind == "fisheye" else rng.uniform(400, 900)
        self.K = [numpy.array([[focal * rng.uniform(.98, 1.02), 0, 320 + rng.uniform(-15, 15)],
                               [0, focal * rng.uniform(.98, 1.02), 240 + rng.uniform(-15, 15)], [0, 0, 1]]) for _ in range(2)]
        self.D = [self.lens() for _ in range(2)]
        self.R = rotation(rng, .04)
        self.T = numpy.array([[-rng.uniform(60, 300)], [rng.uniform(-6, 6)], [rng.uniform(-6, 6)]])

    def lens(self):
        rng = self.rng
        if self.kind == "fisheye":
            return rng.uniform(-.02, .02, 4)
        brown = [rng.uniform(-.35, .1), rng.uniform(-.1, .1), *rng.uniform(-.002, .002, 2), rng.uniform(-.02, .02)]
        rational = [rng.uniform(0, .3), *rng.uniform(-.05, .05, 2)]
        return numpy.array({"radtan": brown[:4], "brown": brown, "rational": brown + rational}[self.kind])

    def rectified(self):
        """OpenCV's R1, R2, P1, P2 and Q for the view without black pixels."""
        if self.kind == "fisheye":
            return cv2.fisheye.stereoRectify(self.K[0], self.D[0], self.K[1], self.D[1], SIZE, self.R, self.T,
                                             flags=cv2.CALIB_ZERO_DISPARITY, balance=0)
        return cv2.stereoRectify(self.K[0], self.D[0], self.K[1], self.D[1], SIZE, self.R, self.T,
                                 flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)[:5]

    def maps(self, index, rotations, projections, size=SIZE):
        init = cv2.fisheye.initUndistortRectifyMap if self.kind == "fisheye" else cv2.initUndistortRectifyMap
        return init(self.K[index], self.D[index], rotations[index], projections[index], size, cv2.CV_32FC1)


def check(rectifier, rig, tolerance=.05):
    """The matrices and all positions are those of OpenCV."""
    r1, r2, p1, p2, q = rig.rectified()
    assert numpy.abs(rectifier.R1 - r1).max() < 1e-6 and numpy.abs(rectifier.R2 - r2).max() < 1e-6
    worst = 0
    for index in range(2):
        worst = max(worst, farthest(rectifier.maps(index), rig.maps(index, (r1, r2), (p1, p2))))
    assert worst < tolerance, worst
    assert numpy.allclose(rectifier.P1, p1, rtol=1e-4, atol=1e-2) and numpy.allclose(rectifier.P2, p2, rtol=1e-4, atol=1e-2)
    assert numpy.allclose(rectifier.Q, q, rtol=1e-4, atol=1e-2)
    return worst


def farthest(ours, theirs):
    """The largest distance between two maps in pixels, where both lie inside of the image."""
    (width, height), (x, y) = SIZE, theirs
    inside = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    known = ~numpy.isnan(ours[0])
    # At the border, a rounded position may lie on the other side.
    assert (known != inside).mean() < .002
    both = known & inside
    assert both.mean() > .9
    return max(numpy.abs(ours[0] - x)[both].max(), numpy.abs(ours[1] - y)[both].max())


def opencv_file(path, rig, **more):
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    names = {"M1": rig.K[0], "D1": rig.D[0], "M2": rig.K[1], "D2": rig.D[1], "R": rig.R, "T": rig.T}
    for name, value in (names | more).items():
        storage.write(name, value)
    if rig.kind == "fisheye":
        storage.write("distortion_model", "fisheye")
    storage.release()
    return path


@pytest.mark.parametrize("kind", ["brown", "rational", "fisheye"])
@pytest.mark.parametrize("seed", range(8))
def test_positions_are_those_of_opencv(tmp_path, kind, seed):
    rig = Rig(seed, kind)
    check(bpstereo.Rectifier(opencv_file(tmp_path / "stereo.yml", rig), size=SIZE), rig)


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_every_format_of_opencv_is_read(tmp_path, ending):
    rig = Rig(1, "brown")
    check(bpstereo.Rectifier(opencv_file(tmp_path / f"stereo.{ending}", rig), size=SIZE), rig)


def test_intrinsic_and_extrinsic_parameters_may_be_two_files(tmp_path):
    rig = Rig(2, "brown")
    r1, r2, p1, p2, q = rig.rectified()
    both = [tmp_path / "intrinsics.yml", tmp_path / "extrinsics.yml"]
    for path, names in zip(both, ({"M1": rig.K[0], "D1": rig.D[0], "M2": rig.K[1], "D2": rig.D[1]},
                                  {"R": rig.R, "T": rig.T, "R1": r1, "R2": r2, "P1": p1, "P2": p2, "Q": q})):
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        for name, value in names.items():
            storage.write(name, value)
        storage.release()
    check(bpstereo.Rectifier(*both, size=SIZE), rig, tolerance=.004)
    # The second one alone describes the rectified pair.
    calibration = bpstereo.Calibration.read(both[1])
    assert calibration.focal == pytest.approx(p1[0, 0]) and calibration.baseline == pytest.approx(-p2[0, 3] / p2[0, 0])
    assert calibration.principal_point == pytest.approx((p1[0, 2], p1[1, 2])) and calibration.doffs == pytest.approx(0)
    with pytest.raises(ValueError, match="before rectification"):
        bpstereo.Calibration.read(both[0], opencv_file(tmp_path / "raw.yml", rig))


def numbers(values):
    return ", ".join(repr(float(value)) for value in numpy.ravel(values))


#: ROS's names of lenses.
LENSES = {"brown": "plumb_bob", "rational": "rational_polynomial", "fisheye": "equidistant"}


def ros_files(folder, rig, rotations, projections):
    for index, name in enumerate(("left", "right")):
        projection = projections[index].copy()
        projection[0, 3] /= 1000
        (folder / f"{name}.yaml").write_text(
            f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ncamera_name: {name}\n"
            f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{numbers(rig.K[index])}]\n"
            f"distortion_model: {LENSES[rig.kind]}\n"
            f"distortion_coefficients:\n  rows: 1\n  cols: {rig.D[index].size}\n  data: [{numbers(rig.D[index])}]\n"
            f"rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{numbers(rotations[index])}]\n"
            f"projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{numbers(projection)}]\n")
    return folder / "left.yaml", folder / "right.yaml"


@pytest.mark.parametrize("kind", ["brown", "rational", "fisheye"])
def test_camera_infos_of_ros(tmp_path, kind):
    rig = Rig(3, kind)
    r1, r2, p1, p2, _ = rig.rectified()
    files = ros_files(tmp_path, rig, (r1, r2), (p1, p2))
    check(bpstereo.Rectifier(*files, size=SIZE), rig, tolerance=.004)
    calibration = bpstereo.Calibration.read(*files)
    assert calibration.baseline == pytest.approx(numpy.linalg.norm(rig.T))
    with pytest.raises(ValueError, match="one camera"):
        bpstereo.Calibration.read(files[0])
    with pytest.raises(ValueError, match="640x480"):
        bpstereo.Rectifier(*files, size=(320, 240))


@pytest.mark.parametrize("kind", ["brown", "rational", "fisheye"])
@pytest.mark.parametrize("flow", [False, True])
def test_messages_of_ros_as_its_command_prints_them(tmp_path, kind, flow):
    """`ros2 topic echo /left/camera_info`, also with --flow-style: all messages until Ctrl-C."""
    yaml = pytest.importorskip("yaml")
    rig = Rig(3, kind)
    r1, r2, p1, p2, _ = rig.rectified()
    files = [tmp_path / "left.yaml", tmp_path / "right.yaml"]
    for index, file in enumerate(files):
        # ROS prints with these arguments.
        printed = [yaml.dump(camera_info(rig, index, (r1, r2), (p1, p2), second), width=sys.maxsize, sort_keys=False,
                             default_flow_style=flow) for second in range(2)]
        file.write_text("".join(f"{message}---\n" for message in printed))
    check(bpstereo.Rectifier(*files, size=SIZE), rig, tolerance=.004)
    assert bpstereo.Calibration.read(*files).baseline == pytest.approx(numpy.linalg.norm(rig.T))


def camera_info(rig, index, rotations, projections, second):
    """A sensor_msgs/msg/CameraInfo of ROS 2."""
    metres = projections[index].copy()
    metres[0, 3] /= 1000
    matrices = {"d": rig.D[index], "k": rig.K[index], "r": rotations[index], "p": metres}
    return {
        "header": {"stamp": {"sec": 1700000000 + second, "nanosec": 33}, "frame_id": f"camera_{index}"},
        "height": SIZE[1], "width": SIZE[0], "distortion_model": LENSES[rig.kind],
        **{name: numpy.ravel(values).tolist() for name, values in matrices.items()},
        "binning_x": 0, "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


@pytest.mark.parametrize("kind", ["radtan", "fisheye"])
def test_camchains_of_kalibr(tmp_path, kind):
    rig = Rig(4, kind)
    transform = numpy.vstack([numpy.column_stack([rig.R, rig.T / 1000]), [0, 0, 0, 1]])
    lines = []
    for index in range(2):
        K = rig.K[index]
        lines.append(f"cam{index}:\n  cam_overlaps: [{1 - index}]\n  camera_model: pinhole\n"
                     f"  distortion_coeffs: [{numbers(rig.D[index])}]\n"
                     f"  distortion_model: {'equidistant' if kind == 'fisheye' else 'radtan'}\n"
                     f"  intrinsics: [{numbers([K[0, 0], K[1, 1], K[0, 2], K[1, 2]])}]\n"
                     f"  resolution: [{SIZE[0]}, {SIZE[1]}]\n  rostopic: /cam{index}/image_raw\n")
        if index:
            lines.append("  T_cn_cnm1:\n" + "".join(f"  - [{numbers(row)}]\n" for row in transform))
    path = tmp_path / "camchain.yaml"
    path.write_text("".join(lines))
    check(bpstereo.Rectifier(path, size=SIZE), rig)


@pytest.mark.parametrize(("cameras", "first", "turned"), [
    # KITTI gives all poses from camera 0, here 90 mm left of camera 2.
    (("02", "03"), numpy.array([-.09, .002, .001]), rotation(numpy.random.default_rng(9), .02)),
    (("00", "01"), numpy.zeros(3), numpy.eye(3)),
], ids=["colour", "grey"])
def test_drives_of_kitti(tmp_path, cameras, first, turned):
    rig = Rig(5, "brown")
    r1, r2, p1, p2, _ = rig.rectified()
    # Its rectified images are smaller.
    size = (600, 440)
    poses = [(turned, first), (rig.R @ turned, rig.R @ first + rig.T.ravel() / 1000)]
    lines = ["calib_time: 09-Jan-2012 13:57:47", "corner_dist: 9.950000e-02"]
    shifts = [first[0], first[0] + p2[0, 3] / p2[0, 0] / 1000]
    for index, name in enumerate(cameras):
        projection = (p1, p2)[index].copy()
        projection[0, 3] = projection[0, 0] * shifts[index]
        parts = {"S": SIZE, "K": rig.K[index], "D": rig.D[index], "R": poses[index][0], "T": poses[index][1], "S_rect": size,
                 "R_rect": (r1, r2)[index], "P_rect": projection}
        lines += [f"{part}_{name}: " + " ".join(f"{value:.9e}" for value in numpy.ravel(values)) for part, values in parts.items()]
    path = tmp_path / "calib_cam_to_cam.txt"
    path.write_text("\n".join(lines) + "\n")
    rectifier = bpstereo.Rectifier(path, size=SIZE)
    for index in range(2):
        columns, rows = rectifier.maps(index)
        assert columns.shape == size[::-1]
        assert farthest((columns, rows), rig.maps(index, (r1, r2), (p1, p2), size)) < .004
    assert bpstereo.Calibration.read(path).baseline == pytest.approx(numpy.linalg.norm(rig.T), rel=1e-6)
    # The lists of projections of KITTI's other data sets.
    projections = {index: p1 for index in range(int(cameras[0]))}
    projections |= {int(name): lines_projection(p, shift) for name, p, shift in zip(cameras, (p1, p2), shifts)}
    lists = tmp_path / "calib.txt"
    lists.write_text("".join(f"P{index}: " + " ".join(f"{value:.9e}" for value in numpy.ravel(values)) + "\n"
                             for index, values in projections.items()))
    assert bpstereo.Calibration.read(lists).baseline == pytest.approx(numpy.linalg.norm(rig.T), rel=1e-6)


def lines_projection(projection, metres):
    projection = projection.copy()
    projection[0, 3] = projection[0, 0] * metres
    return projection


@pytest.mark.parametrize("kind", ["brown", "fisheye"])
def test_points_are_those_of_opencv(tmp_path, kind):
    rig = Rig(7, kind)
    rectifier = bpstereo.Rectifier(opencv_file(tmp_path / "stereo.yml", rig), size=SIZE)
    rng = numpy.random.default_rng(3)
    disparity = rng.uniform(1, 60, SIZE[::-1]).astype(numpy.float32)
    disparity[rng.random(disparity.shape) < .1] = numpy.nan
    known = numpy.isfinite(disparity)
    expected = cv2.reprojectImageTo3D(disparity, rectifier.Q)
    points = rectifier.calibration.points(disparity)
    assert numpy.allclose(points[known], expected[known], rtol=1e-4, atol=1e-2) and numpy.isnan(points[~known]).all()


def test_images_are_those_of_opencv(tmp_path):
    rig = Rig(6, "brown")
    rectifier = bpstereo.Rectifier(opencv_file(tmp_path / "stereo.yml", rig), size=SIZE)
    smooth = cv2.GaussianBlur(numpy.random.default_rng(1).integers(0, 256, (*SIZE[::-1], 3), dtype=numpy.uint8), (0, 0), 3)
    smooth = cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX)
    grey = smooth[:, :, 0]
    left, right = rectifier.rectify(smooth, grey)
    assert left.shape == smooth.shape and right.shape == grey.shape
    r1, r2, p1, p2, _ = rig.rectified()
    for index, (ours, raw) in enumerate(((left, smooth), (right, grey))):
        theirs = cv2.remap(raw, *rig.maps(index, (r1, r2), (p1, p2)), cv2.INTER_LINEAR)
        difference = numpy.abs(ours.astype(int) - theirs)[2:-2, 2:-2]
        assert difference.max() <= 3 and difference.mean() < .5


def test_the_program_rectifies_alike(tmp_path, program):
    rig = Rig(7, "brown")
    calib = opencv_file(tmp_path / "stereo.yml", rig)
    rng = numpy.random.default_rng(2)
    raw = [rng.integers(0, 256, (*SIZE[::-1], 3), dtype=numpy.uint8) for _ in range(2)]
    for name, image in zip(("left", "right"), raw):
        cv2.imwrite(str(tmp_path / f"{name}.png"), image[:, :, ::-1])
    files = [tmp_path / "left.png", tmp_path / "right.png"]
    subprocess.run([program, "rectify", *files, "--calib", calib, "--output", tmp_path / "out"], check=True, capture_output=True)
    rectifier = bpstereo.Rectifier(calib, size=SIZE)
    for image, name in zip(rectifier.rectify(*raw), ("left", "right")):
        assert (bpstereo.read_image(tmp_path / "out" / f"{name}.png") == image).all()
    # In one step, in two, and in Python, the map and the depths are the same.
    one, two, depth, points = (tmp_path / name for name in ("one.npy", "two.npy", "depth.npy", "cloud.ply"))
    match = [program, "match", "--labels", "16", "--output"]
    subprocess.run([*match, one, *files, "--calib", calib, "--rectify", "--depth", depth, "--points", points, "--unknown", "nan"],
                   check=True, capture_output=True)
    rectified = [tmp_path / "out" / name for name in ("left.png", "right.png", "calib.txt")]
    subprocess.run([*match, two, *rectified[:2], "--calib", rectified[2], "--depth", tmp_path / "other.npy", "--unknown", "nan"],
                   check=True, capture_output=True)
    ours = bpstereo.match(*rectifier.rectify(*raw), labels=16)
    assert numpy.array_equal(numpy.load(one), numpy.load(two), equal_nan=True)
    assert numpy.array_equal(numpy.load(one), ours, equal_nan=True)
    assert numpy.allclose(numpy.load(depth), rectifier.calibration.depth(ours), equal_nan=True)
    assert numpy.allclose(numpy.load(depth), numpy.load(tmp_path / "other.npy"), equal_nan=True)
    assert points.stat().st_size > 1000


@pytest.mark.parametrize("text, what", [
    ("", "not a calibration"), ("{", "not a calibration"), ("<a", "not a calibration"), ("[1, 2]", "no names"), ("a: 1", "M1, D1"),
    ("cam0: {intrinsics: [1, 2], camera_model: omni}\ncam1: {T_cn_cnm1: [1]}", "T_cn_cnm1"),
    ("M1: [1]\nM2: [1]\nR: [1]\nT: [1]", "M1 should be 9 numbers"), ("Q: [" + "0, " * 16 + "]", "Q:"),
])
def test_broken_calibrations_are_refused_in_words(tmp_path, text, what):
    path = tmp_path / "broken.yml"
    path.write_text(text)
    with pytest.raises(ValueError, match=what):
        bpstereo.Rectifier(path, size=SIZE)
