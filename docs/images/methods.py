#!/usr/bin/env python3
"""Draws the time of each frame by method, from results/h200_methods.json.

Usage: docs/images/methods.py METHODS.json -o F.svg
"""
import argparse
import json

from log_axes import LEFT, TOP, LogAxes

COLOURS = {"fem": "#1b6ca8", "mpm": "#3c8d40", "this method": "#c1572b"}


class FramesAxes(LogAxes):
    """`x` counts frames, evenly."""

    def px(self, value):
        return LEFT + (value - self.x[0]) / (self.x[1] - self.x[0]) * (self.right - LEFT)


def picture(rows):
    frames = len(rows[0]["by_frame"])
    particles = rows[0]["particles"]
    axes = FramesAxes((0, frames), (-0.2, 2.6), f"Time of each frame of 16 ms, {particles:,} particles, one H200")
    axes.ticks(range(0, frames, 20), (1, 10, 100))
    axes.labels("frame", "ms")
    axes.line(axes.px(0), axes.py(16), axes.px(frames), axes.py(16), 'stroke="#555555" stroke-dasharray="6 4"')
    axes.text(axes.right + 12, axes.py(16) + 4, "real time", extra='fill="#555555"')
    for row, each in enumerate(rows):
        name = each["name"].removesuffix("_cuda")
        settings = each["settings"].partition(",")[0].replace("iterations=", ", K = ")
        points = " ".join(f"{axes.px(frame + 1):.1f},{axes.py(1000 * seconds):.1f}"
                          for frame, seconds in enumerate(each["by_frame"]))
        dash = ' stroke-dasharray="5 3"' if settings.endswith("= 32") else ""
        style = f'stroke="{COLOURS[name]}" stroke-width="2"{dash}'
        axes.parts.append(f'<polyline points="{points}" fill="none" {style}/>')
        y = TOP + 14 + 20 * row
        axes.line(axes.right + 12, y - 4, axes.right + 42, y - 4, style)
        axes.text(axes.right + 48, y, name + settings)
    return axes.svg()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("methods")
    parser.add_argument("-o", dest="output", required=True)
    options = parser.parse_args()
    with open(options.methods, encoding="utf-8") as file:
        rows = [row for row in json.load(file)["methods"] if row.get("by_frame")]
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture(rows))


if __name__ == "__main__":
    main()
