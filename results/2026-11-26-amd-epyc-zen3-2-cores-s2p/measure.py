"""Compares what s2p made with the truth of the scene."""
import glob
import sys
import numpy as np, rasterio
from plyfile import PlyData
from pyproj import Transformer
from scipy.ndimage import map_coordinates
G, E, LON, LAT = 0.5, 1400, 2.35, 48.85
MX, MY = 111320 * np.cos(np.radians(LAT)), 111195.0
Z = np.load("truth.npz")["z"]
back = Transformer.from_crs("epsg:32631", "epsg:4326", always_xy=True)
for out in sys.argv[1:]:
    shares, ranges = [], []
    for disp in sorted(glob.glob(out + "/tiles/*/*/pair_1/rectified_disp.tif")):
        folder = disp[: -len("rectified_disp.tif")]
        d = rasterio.open(disp).read(1); r = rasterio.open(folder + "rectified_ref.tif").read(1)
        m = rasterio.open(folder + "rectified_mask.png").read(1)
        c = rasterio.open(folder + "rectified_disp_confidence.tif").read(1)
        lo, hi = np.loadtxt(folder + "disp_min_max.txt")
        inside = np.isfinite(r)
        shares.append((np.isfinite(d)[inside].mean(), (m[inside] > 0).mean()))
        ranges.append((lo, hi, np.nanmin(d), np.nanmax(d), np.nanmin(c), np.nanmedian(c), np.nanmax(c), d.shape, inside.mean()))
    pts = []
    for ply in glob.glob(out + "/tiles/*/*/cloud.ply"):
        v = PlyData.read(ply)["vertex"]; pts.append(np.stack([v["x"], v["y"], v["z"]], 1))
    p = np.concatenate(pts); lon, lat = back.transform(p[:, 0], p[:, 1])
    X, Y = (lon - LON) * MX, (lat - LAT) * MY
    t = map_coordinates(Z, [E / 2 - Y / G, E / 2 + X / G], order=1, mode="nearest")
    e = p[:, 2] - t
    print(out, "tiles", len(shares), "finite, mask", np.mean(shares, 0).round(4))
    for r in ranges: print("   range asked %.1f..%.1f found %.2f..%.2f confidence %.2f %.2f %.2f %s inside %.2f" % r)
    print("   points %d, median error %.3f m, median |e - median| %.3f m, within 1 m %.4f, within 2 m %.4f" % (
        len(p), np.median(e), np.median(abs(e - np.median(e))), np.mean(abs(e - np.median(e)) < 1), np.mean(abs(e - np.median(e)) < 2)))
