// A run of somebody else's simulator, frame by frame, from named arrays (docs/reference/run.md).
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/named_arrays.h"
#include "model/io/run_segments.h"
#include "model/precision.h"
#include "oracles/runs/run.h"

namespace cutproof::harness {

// What a segment may hold. Of texts: `promises`.
const std::vector<KnownArray>& run_arrays();
const std::vector<KnownArray>& run_texts();

// One segment: frames of equally many particles with one coupling. Shapes, types and names are the file's: where one is
// wrong an InputError says so. Values are the run's.
class RunSegment {
 public:
  // `frame`: the number of its first frame in the run.
  RunSegment(io::ArrayFile contents, std::string file, int64_t frame);
  RunSegment(const RunSegment&) = delete;
  RunSegment& operator=(const RunSegment&) = delete;

  int64_t frames() const { return frames_; }
  int64_t particles() const { return particles_; }
  Precision precision() const { return precision_; }  // of the positions
  oracles::RunFrame frame(int64_t k) const;           // k-th of the segment, whose spans live as long as it

  oracles::RunHeader header() const;  // what is given once: of the first segment
  // Nothing where this segment does not give them anew.
  std::optional<oracles::RunCoupling> coupling() const;
  std::optional<std::vector<double>> mass() const;  // [n] [kg]

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
};

// The frames of a run in order, as they are read.
class RunFrames {
 public:
  explicit RunFrames(io::RunSegments& segments) : segments_(segments) {}

  // Goes to the next frame; false after the last one, and then there is no segment any more.
  bool next();
  // Of the frame where it is.
  const RunSegment& segment() const { return *segment_; }
  bool begins_segment() const { return in_segment_ == 0; }
  oracles::RunFrame frame() const { return segment_->frame(in_segment_); }

 private:
  io::RunSegments& segments_;
  std::unique_ptr<RunSegment> segment_;
  int64_t begun_ = 0, in_segment_ = 0;  // frames of the run before the segment; frame in it
};

}  // namespace cutproof::harness
