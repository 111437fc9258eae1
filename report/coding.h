// How numbers lie in a page: places as steps of 16 bits, integers as differences, bytes by significance, then gzip and
// base64. The page takes it back (report/page/coding.js); every browser inflates gzip by itself.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/vec.h"

namespace cutproof::report {

// The place of what is not finite, or lies outside the box: it is not drawn.
inline constexpr uint16_t kNowhere = 65535;
inline constexpr int32_t kMostStep = 65534;

struct Box {
  Vec3 low, high;
};

// Number of the step that is nearest to x, or kNowhere. A box without extent along an axis has one step.
uint16_t step_of(double x, double low, double high);
double place_of(uint16_t step, double low, double high);
// By how much a place within the box may be off along an axis, at most [the unit of the box].
double loss(const Box& box);

// Steps of each point, axis by axis: [3 n]. A point with one coordinate that is nowhere is so with all three.
std::vector<uint16_t> steps_of(std::span<const Vec3> points, const Box& box);

// Appends `steps` as differences to the entry before, of differences to `before` (the same points one moment earlier;
// empty: zeros), low bytes first, then high bytes. Neighbours move alike, so most of these are nearly nothing.
void append_steps(std::string& bytes, std::span<const uint16_t> steps, std::span<const uint16_t> before);
// Appends integers as differences to the entry before, in four planes of bytes.
void append_integers(std::string& bytes, std::span<const int32_t> values);
// Appends a bit for each flag, eight to a byte, the lowest first.
void append_flags(std::string& bytes, std::span<const uint8_t> flags);

// The same input gives the same bytes: no name, no time. Throws std::bad_alloc without memory.
std::string gzip(std::string_view bytes);
std::string base64(std::string_view bytes);

// JSON as it may stand in a <script> element: nothing in it ends the element or begins a comment.
std::string script_json(std::string json);

}  // namespace cutproof::report
