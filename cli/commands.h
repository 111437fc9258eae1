// The commands of the program `cutproof`. Each returns an exit status: 0 everything holds, 1 a verdict failed.
// Bad input is an InputError (status 2), a failing machine a MachineError (status 3); main() turns them into both.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cutproof::cli {

struct RunOptions {
  std::string scene;
  std::string backend = "reference";
  std::string mesh;                  // takes the place of the scene's body
  std::string unit = "mm";           // of the mesh's numbers
  std::optional<int64_t> particles;  // wanted count
  std::optional<int64_t> frames;     // at most this many of the scene's frames
  bool check = false;
  std::string against;        // "" or "reference"
  std::string mode = "both";  // of the comparison: lockstep, shadow, both
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

struct BenchOptions {
  std::string backend = "reference";
  std::vector<int64_t> sizes;     // particles; empty: by backend
  std::optional<int64_t> frames;  // timed; absent: by backend
  std::string split;              // blocks, global or both; empty: blocks
  std::string rotation;           // empty: the kernels' default
  std::string json;
};
int bench_stages(const BenchOptions& options);

inline constexpr const char* kVersion = CUTPROOF_VERSION;

}  // namespace cutproof::cli
