"""A chart with two logarithmic axes as SVG: what the curves of this folder share."""
import math
from html import escape

WIDTH, HEIGHT = 800, 470
LEFT, RIGHT, TOP, BOTTOM = 70, 230, 40, 50


class LogAxes:
    """`x` and `y`: least and greatest exponent of ten; `beside`: what is left free right of the chart. Everything is
    drawn in the order of the calls."""

    bottom = HEIGHT - BOTTOM

    def __init__(self, x, y, title, beside=RIGHT):
        self.x, self.y = x, y
        self.right = WIDTH - beside
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
            f'<text x="{LEFT}" y="24" font-size="15">{escape(title)}</text>',
        ]

    def px(self, value):
        return LEFT + (math.log10(value) - self.x[0]) / (self.x[1] - self.x[0]) * (self.right - LEFT)

    def py(self, value):
        return self.bottom - (math.log10(value) - self.y[0]) / (self.y[1] - self.y[0]) * (self.bottom - TOP)

    def line(self, a, b, c, d, style):
        self.parts.append(f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" {style}/>')

    def text(self, x, y, what, anchor="start", extra=""):
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {extra}>{escape(what)}</text>')

    def ticks(self, xs, ys, x_name="{:g}".format, y_name="{:g}".format):
        for value in xs:
            self.line(self.px(value), TOP, self.px(value), self.bottom, 'stroke="#e0e0e0"')
            self.text(self.px(value), self.bottom + 18, x_name(value), "middle")
        for value in ys:
            self.line(LEFT, self.py(value), self.right, self.py(value), 'stroke="#e0e0e0"')
            self.text(LEFT - 8, self.py(value) + 4, y_name(value), "end")

    def labels(self, x, y):
        self.text((LEFT + self.right) / 2, HEIGHT - 12, x, "middle")
        middle = (TOP + self.bottom) / 2
        self.text(18, middle, y, "middle", f'transform="rotate(-90 18 {middle:.0f})"')

    def tolerance(self, value):
        self.line(LEFT, self.py(value), self.right, self.py(value), 'stroke="#555555" stroke-dasharray="6 4"')

    def svg(self):
        return "\n".join(self.parts + ["</svg>"]) + "\n"
