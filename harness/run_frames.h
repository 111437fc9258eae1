// A run of another simulator, frame by frame, from named arrays (docs/reference/run.md).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/named_arrays.h"
#include "model/io/run_segments.h"
#include "model/precision.h"
#include "model/skin.h"
#include "oracles/runs/run.h"

namespace cutproof::harness {

// Arrays that a segment may contain. Texts: `promises`.
const std::vector<KnownArray>& run_arrays();
const std::vector<KnownArray>& run_texts();

// One segment: frames of equally many particles with one coupling. Shapes, types and names are the file's: where one is
// wrong an InputError says so. Values are the run's.
class RunSegment {
 public:
  using Triangles = std::vector<std::array<int32_t, 3>>;

  // `frame`: the number of its first frame in the run.
  RunSegment(io::ArrayFile contents, std::string file, int64_t frame);
  RunSegment(const RunSegment&) = delete;
  RunSegment& operator=(const RunSegment&) = delete;

  int64_t frames() const { return frames_; }
  int64_t particles() const { return particles_; }
  Precision precision() const { return precision_; }  // of the positions
  oracles::RunFrame frame(int64_t k) const;           // k-th of the segment, whose spans live as long as it

  oracles::RunHeader header() const;  // arrays that are given once: of the first segment
  // Refuses an array of a later segment that would be ignored.
  void refuse_what_is_given_once() const;
  // Empty where this segment does not give them again.
  std::optional<oracles::RunCoupling> coupling() const;
  std::vector<double> mass() const;  // [n] [kg]
  bool has_vertices() const { return in_.has("vertices"); }
  std::span<const Vec3> vertices(int64_t k) const;  // of the skin, k-th frame of the segment
  const std::optional<Triangles>& triangles() const { return triangles_; }

  const io::ArrayFile& contents() const { return contents_; }
  const NamedArrays& arrays() const { return in_; }

 private:
  const Array* find(std::string_view name, std::vector<int64_t> inner) const;
  std::vector<Vec3> vectors(std::string_view name, int64_t inner) const;
  std::vector<double> numbers(std::string_view name) const;
  std::vector<uint8_t> flags(std::string_view name) const;
  std::vector<Vec3> quads() const;
  double positive(std::string_view name, double otherwise, bool may_be_zero) const;
  template <class T>
  std::span<const T> of_frame(const std::vector<T>& all, int64_t k) const;

  const io::ArrayFile contents_;
  const std::string file_;
  const NamedArrays in_;
  const int64_t first_;
  bool is_one_ = false;
  int64_t frames_ = 0, particles_ = 0;
  Precision precision_ = Precision::binary64;
  std::vector<Vec3> positions_, velocities_, spin_, impulse_, blade_;
  std::vector<double> time_, energy_;
  std::vector<uint8_t> alive_, held_, removed_;
  std::vector<int32_t> parent_, piece_;
  std::vector<Vec3> vertices_;
  std::optional<Triangles> triangles_;
};

// The frames of a run, one after the other, each with its arrays.
class RunFrames {
 public:
  explicit RunFrames(io::RunSegments segments) : segments_(std::move(segments)) {}

  // To the first frame, then to the one after; false: there is none. All that the others give is valid until then.
  // Throws InputError where a segment cannot be understood, and if there is no frame at all.
  bool next();
  const oracles::RunFrame& frame() const { return frame_; }
  const RunSegment& segment() const { return *segment_; }
  bool begins_segment() const { return in_segment_ == 0; }  // the frame is the first of its segment
  int64_t segments() const { return begun_; }               // begun so far
  // Of the first segment, which alone gives it; valid after the last frame, too.
  const oracles::RunHeader& header() const { return *header_; }
  // Valid in the frame; arrays that a segment does not give again stay valid. Null: not given so far.
  const oracles::RunCoupling* coupling() const { return coupling_ ? &*coupling_ : nullptr; }
  bool has_new_coupling() const { return begins_segment() && is_new_coupling_; }
  std::span<const Vec3> skin_places() const { return segment_->vertices(in_segment_); }
  // The skin of the frame; its vertices have no owners.
  std::optional<Skin> skin() const;
  bool has_new_triangles() const { return begins_segment() && segment_->triangles().has_value(); }

 private:
  void renew(oracles::RunCoupling given);

  io::RunSegments segments_;
  std::unique_ptr<RunSegment> segment_;
  oracles::RunFrame frame_;
  std::optional<oracles::RunHeader> header_;
  std::optional<RunSegment::Triangles> triangles_;
  std::optional<oracles::RunCoupling> coupling_;
  bool is_new_coupling_ = false;
  int64_t before_ = 0, in_segment_ = 0, begun_ = 0;  // frames before the segment; the frame in it; segments
};

}  // namespace cutproof::harness
