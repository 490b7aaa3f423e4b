"""Two satellite images with affine RPCs of a made scene: hills, buildings and noise as texture."""
import json, sys
import numpy as np, rasterio
from rasterio.rpc import RPC
from scipy.ndimage import gaussian_filter, map_coordinates, zoom
G = 0.5                      # metres a pixel
N = 800                      # pixels of an image's side
LON, LAT = 2.35, 48.85
MX, MY = 111320 * np.cos(np.radians(LAT)), 111195.0
rng = np.random.default_rng(7)
# ground in metres, X east, Y north, centred
E = 1400                     # cells of the ground, at G
def truth():
    hill = gaussian_filter(rng.normal(size=(E, E)), 90); hill = 6 * hill / hill.std()
    z = 15 + hill - hill.min()*0
    for _ in range(90):
        w, h = rng.integers(24, 80, 2); x, y = rng.integers(0, E - 80, 2)
        z[y:y+h, x:x+w] = z[y:y+h, x:x+w].mean() + rng.uniform(5, 22)
    return z
def texture():
    t = gaussian_filter(rng.normal(size=(E, E)), 0.8); t /= t.std()
    for s in (2, 5, 15):
        u = gaussian_filter(rng.normal(size=(E, E)), s); t += u / u.std()
    return 600 + 120 * t
Z, T = truth(), texture()
np.savez_compressed("truth.npz", z=Z.astype("f4"))
VIEWS = {"ref": (-0.10, 0.05), "sec": (0.16, -0.12)}   # shift of a pixel per metre of height, in metres: east, north
def ground(a, X, Y):
    return map_coordinates(a, [E / 2 - Y / G, E / 2 + X / G], order=1, mode="nearest")
for name, (kx, ky) in VIEWS.items():
    c, r = np.meshgrid(np.arange(N), np.arange(N))
    x0, y0 = (c - N / 2) * G, -(r - N / 2) * G          # position at height 0
    hit = np.full((N, N), np.nan)
    for h in np.arange(Z.max() + 0.5, Z.min() - 0.5, -0.25):   # from above: what is hit first is seen
        todo = np.isnan(hit)
        if not todo.any(): break
        X, Y = x0[todo] - kx * h, y0[todo] - ky * h
        below = ground(Z, X, Y) >= h
        v = hit[todo]; v[below] = h; hit[todo] = v
    image = ground(T, x0 - kx * hit, y0 - ky * hit) + rng.normal(0, 8, (N, N))
    # normalised: lat, lon in +-1 for +-500 m, alt in +-1 for +-100 m around 20
    S, A0, AS = 500.0, 20.0, 100.0
    col, row, one = np.zeros(20), np.zeros(20), np.zeros(20); one[0] = 1
    CS = N / 2
    # col = N/2 + (X + kx*h)/G ; geotiff coefficient order: 1, lon, lat, height
    col[0] = kx * A0 / G / CS; col[1] = S / G / CS; col[3] = kx * AS / G / CS
    row[0] = -ky * A0 / G / CS; row[2] = -S / G / CS; row[3] = -ky * AS / G / CS
    rpc = RPC(height_off=A0, height_scale=AS, lat_off=LAT, lat_scale=S / MY, long_off=LON, long_scale=S / MX,
              line_off=N / 2, line_scale=CS, samp_off=N / 2, samp_scale=CS, line_num_coeff=list(row), line_den_coeff=list(one),
              samp_num_coeff=list(col), samp_den_coeff=list(one), err_bias=0, err_rand=0)
    with rasterio.open(name + ".tif", "w", driver="GTiff", width=N, height=N, count=1, dtype="uint16", rpcs=rpc) as f:
        f.write(np.clip(image, 1, 4095).astype("uint16"), 1)
    np.save(name + "_z.npy", hit.astype("f4"))
    print(name, image.min(), image.max(), np.isnan(hit).mean())
for alg, out in (("mgm", "mgm"), ("mgm_multi", "mgm_multi")):
    for who in ("bp", "own"):
        json.dump({"out_dir": f"out_{who}_{alg}", "temporary_dir": f"tmp_{who}_{alg}", "images": [{"img": "ref.tif"}, {"img": "sec.tif"}],
                   "full_img": True, "tile_size": 400, "matching_algorithm": alg, "disp_range_method": "sift", "max_processes": 1,
                   "dsm_resolution": 0.5, "horizontal_margin": 50}, open(f"{who}_{alg}.json", "w"), indent=1)
