// What a page shows of a run, moment by moment: which of a recording's snapshots, and these as chunks that a browser
// takes apart one at a time.
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/io/recording.h"
#include "model/setup.h"
#include "report/results.h"

namespace cutproof::report {

// What a run of somebody else's simulator has in a frame that no state holds.
struct FrameOfRun {
  std::vector<int32_t> piece;  // [n] by the blade's sweep; any number below n for each, -1 of what is in none
  std::vector<Vec3> swept;     // by the blade, on the way to this frame: quads of four corners [m]; NaN: none
  std::optional<double> time;  // [s]
};

// Where snapshots come from: a recording, or a test. Snapshot 0 is the state as loaded.
struct Source {
  const Setup& setup;
  int64_t count = 0;
  std::function<io::Snapshot(int64_t)> snapshot;
  // Of a run of somebody else's simulator, whose snapshots are the ends of frames 0, 1, … and have clusters that are
  // coupling groups; null: of our own.
  std::function<FrameOfRun(int64_t)> of_run = nullptr;
  bool is_foreign() const { return of_run != nullptr; }
};

// What is kept of particles and moments where all of it would be too much for a page.
struct Thinning {
  int64_t every_frame = 1;     // a frame in so many; those that a finding names are kept all the same
  int32_t every_particle = 1;  // a particle in so many; those that a finding names are kept all the same
  friend bool operator==(const Thinning&, const Thinning&) = default;
};

struct Moment {
  int64_t snapshot = 0;
  int64_t frame = 0;  // that it belongs to: the state after skin counts to the frame that it ends
  Stage stage = Stage::skin;
  bool is_start = false;  // the state as loaded
  friend bool operator==(const Moment&, const Moment&) = default;
};

// The state of a frame's end, or as loaded.
struct FrameEnd {
  int64_t frame = -1;  // -1: as loaded
  int64_t particles = 0, clusters = 0, components = 0, triangles = 0, removed = 0;
};

// The particles that show a finding, by their place among those kept.
struct Marks {
  int64_t moment = -1;                   // -1: the recording has no moment
  bool is_exact = false;                 // the moment is the one after the finding's stage
  bool is_partly = false;                // there are more than are marked
  std::vector<int32_t> particles, path;  // of the witness
  std::vector<int32_t> clusters;         // members of its clusters
  struct Cluster {
    int32_t number = -1;
    std::vector<int32_t> members;
  };
  std::vector<Cluster> joined;   // the same of each, where they are few
  std::vector<int32_t> corners;  // of its triangles, three of each: vertices of that moment's skin
};

// Pictures of one run as a browser takes them apart.
struct Chunks {
  std::vector<std::string> text;          // base64 of gzip; the first holds the first moment alone
  std::vector<std::size_t> first_moment;  // of each
  nlohmann::json details;                 // one for each moment: what the page's words need
  double loss = 0;                        // by how much a place may be off [h]
  int64_t patches_left_out = 0;           // of the blade's sweep, which are not drawn
  int64_t bytes = 0;
};

struct Beside;
struct FirstApart;

struct Pictures {
  std::vector<Moment> moments;
  std::vector<FrameEnd> frames;  // all of the recording, whatever was thinned
  std::vector<Marks> marks;      // one for each finding
  Chunks own, beside;            // of the run itself; of the one beside it, if that is shown
  int32_t particles = 0;         // kept
  Thinning thinning;
  Vec3 reach_low, reach_high;  // box of all that is alive at the end of any frame, as far as it is drawn [m]
  int64_t bytes = 0;           // of all chunks
  nlohmann::json comparison;   // with the run beside it, or null
};

// Thins until the chunks have about so many bytes at most: frames first, then particles too. Throws what snapshot()
// throws. `beside`: another run of the same body, or null.
Pictures pictures_of(const Source& source, const std::vector<Finding>& findings, int64_t most_bytes,
                     const Beside* beside = nullptr);

// Of all moments those that a page shows: the start, the last frame, one frame in so many, and every stage of the
// frames that are named, because something in them is spoken of.
std::vector<Moment> kept_moments(const std::vector<Moment>& all, const std::set<int64_t>& named, int64_t every_frame);

// As the page's script has it.
nlohmann::json to_json(const Marks& marks);

}  // namespace cutproof::report
