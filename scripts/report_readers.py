"""Reads the report of a tiny run, its charts and its exports with other programs. Part of scripts/check-formats."""
import base64, csv, html.parser, io, json, re
from xml.etree import ElementTree

from public_pairs import ROOT
from trials import check

READERS = ("cairosvg", "jsonschema")
SVG = "{http://www.w3.org/2000/svg}"
# HTML's elements without an end.
VOID = {"meta", "link", "img", "br", "hr", "input", "wbr", "col"}


def report(folder, bp):
    bp("reproduce", "--quick", "--synthetic", "--samples", 1, "--results", "results", "--machine", "here")
    run = next((folder / "results").iterdir())
    text = (run / "record.json").read_bytes()
    bp("report", run)
    check((run / "record.json").read_bytes() == text, "a report leaves its record")
    record = json.loads(text)
    return recorded(record) + exported(bp, run, record) + charts(run) + figures(run) + page(run)


def recorded(record):
    import jsonschema
    jsonschema.validate(record, json.loads((ROOT / "results" / "schema.json").read_text()), jsonschema.Draft202012Validator)
    check(record["complete"] and len(record["cells"]) > 50, "a complete run")
    return ["record.json: jsonschema"]


def exported(bp, run, record):
    """The numbers of a record in the formats of other programs."""
    rows = list(csv.DictReader(io.StringIO(bp("export", "--format", "csv", run).decode(), newline=""), strict=True))
    measured = [(cell, cell["outcome"]["measured"]) for cell in record["cells"]]
    expected = [(cell, found, sample) for cell, found in measured for sample in found["samples"]]
    check(len(rows) == len(expected), "csv: a row for each sample")
    for row, (cell, found, sample) in zip(rows, expected):
        check([row[name] for name in ("scene", "plan", "backend")] == [cell[name] for name in ("scene", "plan", "backend")], "csv: names")
        check(row["device"] == cell["device"]["name"] and row["labels_sha256"] == found["labels_sha256"], "csv: device, labels")
        check(float(row["total_ms"]) == sample["total_ms"] and int(row["energy"]) == found["energy"]["total"], "csv: time, energy")
        check(float(row["visible_rmse_px"]) == found["visible"]["rmse"], "csv: error")
        check(None not in row and None not in row.values(), "csv: as many fields as columns")
    export = lambda name: json.loads(bp("export", "--format", name, run))
    # A mean over the scenes of medians, here of one sample each.
    times = {}
    for row in rows:
        times.setdefault(row["plan"], []).append(float(row["total_ms"]))
    means = {plan: sum(found) / len(found) for plan, found in times.items()}
    total = lambda name: re.fullmatch(r"[^/]+/([^/]+)/rayon: total", name)
    action = {total(entry["name"])[1]: entry["value"] for entry in export("github-action-benchmark") if total(entry["name"])}
    bencher = {total(name)[1]: entry["latency"]["value"] / 1e6 for name, entry in export("bencher").items() if total(name)}
    chart = export("vega-lite")
    vega = {value["plan"]: value["ms"] for value in chart["data"]["values"]}
    check("vega-lite" in chart["$schema"], "vega-lite: its schema")
    for name, found in (("github-action-benchmark", action), ("bencher", bencher), ("vega-lite", vega)):
        check(found.keys() == means.keys() and all(abs(found[plan] / means[plan] - 1) < 1e-9 for plan in means), name)
    return ["export csv: csv", "export github-action-benchmark: json", "export bencher: json", "export vega-lite: json"]


def charts(run):
    """Each chart's PNG shows what Cairo draws of its SVG: the coloured lines and marks, as the text's font differs."""
    import cv2, numpy
    from PIL import Image
    coloured = lambda image: cv2.GaussianBlur(numpy.ptp(image.astype(numpy.float32), axis=2), (0, 0), 3)
    drawings = sorted(run.glob("diagram-*.svg"))
    check(len(drawings) > 10, "there are charts")
    for path in drawings:
        read = numpy.array(Image.open(path.with_suffix(".png")).convert("RGB"))
        check(numpy.array_equal(read[..., ::-1], cv2.imread(str(path.with_suffix(".png")))), f"{path.stem}.png: OpenCV")
        drawn = render(path, 2)
        check(drawn.shape == read.shape, f"{path.stem}: size")
        drawn, read = coloured(drawn), coloured(read)
        check(read.sum() > 0 and abs(drawn - read).sum() < 0.05 * (drawn + read).sum(), f"{path.stem}: SVG and PNG")
    return [f"{len(drawings)} charts as PNG: Pillow", f"{len(drawings)} charts as PNG: OpenCV", f"{len(drawings)} charts as SVG: CairoSVG"]


def figures(run):
    """The maps in each figure are drawn where it says."""
    import numpy
    from PIL import Image
    drawings = sorted(run.glob("figure-*.svg"))
    check(len(drawings) > 3, "there are figures")
    for path in drawings:
        drawn, images = render(path, 1), ElementTree.parse(path).findall(f"{SVG}image")
        check(images, f"{path.stem}: images")
        for image in images:
            x, y, width, height = (int(image.get(name)) for name in ("x", "y", "width", "height"))
            kind, data = image.get("href").split(",")
            map_ = numpy.array(Image.open(io.BytesIO(base64.b64decode(data, validate=True))).convert("RGB"))
            check(kind == "data:image/png;base64" and map_.shape == (height, width, 3), f"{path.stem}: an image's size")
            check(numpy.array_equal(drawn[y:y + height, x:x + width], map_), f"{path.stem}: an image")
    return [f"{len(drawings)} figures: ElementTree, Pillow and CairoSVG"]


def render(path, scale):
    import cairosvg, numpy
    from PIL import Image
    image = cairosvg.svg2png(url=str(path), scale=scale, background_color="white")
    return numpy.array(Image.open(io.BytesIO(image)).convert("RGB"))


class Page(html.parser.HTMLParser):
    """The elements of a page, of which each must end before the one around it."""

    def __init__(self):
        super().__init__()
        self.open, self.count, self.ids, self.links = [], {}, set(), set()

    def handle_starttag(self, tag, attributes):
        self.handle_startendtag(tag, attributes)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.count[tag] = self.count.get(tag, 0) + 1
        self.ids |= {value for name, value in attributes if name == "id"}
        self.links |= {value[1:] for name, value in attributes if name == "href" and value.startswith("#")}

    def handle_endtag(self, tag):
        check(self.open and self.open.pop() == tag, f"report.html: </{tag}> at line {self.getpos()[0]}")


def page(run):
    """The page is well formed, its links lead somewhere, and it holds every chart and figure."""
    text = (run / "report.html").read_text()
    read = Page()
    read.feed(text)
    read.close()
    check(not read.open, f"report.html: {read.open} do not end")
    check(read.links and read.links <= read.ids, f"report.html: links to {read.links - read.ids}")
    drawings = list(run.glob("*.svg"))
    check(read.count["svg"] == len(drawings), "report.html: charts and figures")
    title = lambda svg: ElementTree.fromstring(svg).find(f"{SVG}title").text
    titles = sorted(map(title, re.findall(r"<svg.*?</svg>", text, re.DOTALL)))
    check(titles == sorted(title(path.read_text()) for path in drawings), "report.html: titles of charts and figures")
    linked = set(re.findall(r"\]\(([^)#]+\.svg)\)", (run / "REPORT.md").read_text()))
    check(linked == {path.name for path in drawings}, "REPORT.md: charts and figures")
    return ["report.html: html.parser and ElementTree", "REPORT.md: links"]
