// The commands of the program `cutproof`. Each returns an exit status: 0 everything holds, 1 a verdict failed.
// Bad input is an InputError (status 2), a failing machine a MachineError (status 3); main() turns them into both.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/backends.h"

namespace cutproof::cli {

struct RunOptions {
  std::string scene;
  BackendChoice backend;
  std::string mesh;                  // takes the place of the scene's body
  std::string unit = "mm";           // of the mesh's numbers
  std::optional<int64_t> particles;  // wanted count
  std::optional<int64_t> frames;     // at most this many of the scene's frames
  bool check = false;
  std::string against;        // "" or "reference"
  std::string mode = "both";  // of the comparison: lockstep, free-running, both
  std::string errors;         // names of errors with commas between them, or "all"; empty: none
  std::string record;
  std::string json;
};
int run(const RunOptions& options);

struct CheckOptions {
  std::string recording;
  std::string json;
};
int check(const CheckOptions& options);

struct InfoOptions {
  bool scene = false;  // print the reference of scene files
};
int info(const InfoOptions& options);

struct FuzzOptions {
  BackendChoice backend{"host", {}, {}, "random", 1, 0};
  std::optional<int64_t> cases;  // default: 1000, or as many as `seconds` allow
  std::optional<double> seconds;
  uint64_t seed = 1;
  std::string sizes = "0-79";  // of cases, which take turns: 0 is nothing, 100 up to about 20,000 particles
  bool dynamics = false;
  int batch = 0;      // bodies in one load; 0: 16 for the reference, else 64
  int threads = 0;    // 0: as many as the machine has
  std::string shard;  // "i/N"; empty: all
  bool keep_going = false;
  std::string save = ".";  // the folder for counterexamples
  std::string json;
  std::vector<std::string> merge;  // results of shards, to be put together; nothing is run
};
int fuzz(const FuzzOptions& options);

struct ReplayOptions {
  std::string counterexample;
  std::optional<BackendChoice> backend;  // absent: the one on which it was found
  std::string record;
};
int replay(const ReplayOptions& options);

struct TuneOptions {
  std::string scene;
  BackendChoice backend;
  double tolerance = 0;          // [h]
  std::string answer = "limit";  // what errors are distances from: limit, substeps
  std::optional<int64_t> frames;
  bool without_skin = false;
  bool full = false;  // nothing is given up: errors and times of all that is tried
  int repeats = 3;    // timed runs of a configuration
  std::string write;  // the scene that was found; empty: NAME_tuned.json in the working folder
  std::string json;
};
int tune(const TuneOptions& options);

inline constexpr const char* kVersion = CUTPROOF_VERSION;

}  // namespace cutproof::cli
