// The readers of files from outside, as functions of bytes. The fuzzers (fuzz.cpp) and the replay of what they once
// found (input_fuzzing_test.cpp) call the same functions.
//
// The contract of every reader: any bytes give a valid result or an InputError that names the file and a remedy.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fixtures/import/mesh.h"

namespace cutproof::input_fuzzing {

enum class Outcome { read, refused };

struct Target {
  std::string_view name;
  // Throws std::logic_error if the contract is broken; what a reader throws and should not comes through as it is.
  Outcome (*feed)(std::string_view bytes);
  // Inputs that are read, all of them made by code or shipped with the project.
  std::vector<std::string> (*seeds)();
};

std::span<const Target> all_targets();

// What keeps a mesh from being what read_mesh promises, beyond what needs exact arithmetic: indices, finite and
// distinct points, none unused, closed, manifold edges, neighbours oriented alike, facing outwards.
std::optional<std::string> defect_of(const fixtures::SurfaceMesh& mesh);

// --- Shared by the targets -----------------------------------------------------------------------------------------

// Path of a file of this name in a folder of this process, which lies under TMPDIR and goes when the process ends.
std::string scratch_path(const std::string& name);
void write_scratch(const std::string& name, std::string_view bytes);
std::string bytes_of_file(const std::string& path);

[[noreturn]] void broken_contract(const std::string& what);

// Runs `action`; an InputError is a refusal, if it is a whole one.
template <class F>
Outcome outcome_of(F&& action);

// What is read can be written, and reads back as what gives the same text. `read(text, file)` is the reader, to_json()
// of its namespace the writer, `thing` what they are of: "a question".
template <class Read>
Outcome feed_document(std::string_view bytes, const std::string& thing, Read&& read);

// One for each reader, in files of their names.
extern const Target kScene, kStl, kObj, kPly, kOff, kRecording, kRecordingContents, kArrays, kCounterexample, kCampaign,
    kResults, kQuestion, kRun;

}  // namespace cutproof::input_fuzzing

#include "model/error.h"

namespace cutproof::input_fuzzing {

template <class F>
Outcome outcome_of(F&& action) {
  try {
    action();
    return Outcome::read;
  } catch (const InputError& error) {
    const std::string_view message = error.what();
    if (error.file().empty() || message.find("\n  remedy: ") == std::string_view::npos) {
      broken_contract("a refusal names no file or no remedy: " + std::string(message));
    }
    if (message != printable_lines(message)) broken_contract("a refusal is not printable");
    return Outcome::refused;
  }
}

template <class Read>
Outcome feed_document(std::string_view bytes, const std::string& thing, Read&& read) {
  return outcome_of([&] {
    const std::string written = to_json(read(std::string(bytes), "fed.json"));
    std::string again;
    try {
      again = to_json(read(written, "written.json"));
    } catch (const InputError& error) {
      broken_contract(thing + " that was read is refused when it is written out: " + std::string(error.what()));
    }
    if (again != written) broken_contract(thing + " changes when it is written out and read again");
  });
}

}  // namespace cutproof::input_fuzzing
