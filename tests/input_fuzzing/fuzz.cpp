// The readers under libFuzzer; the environment's CUTPROOF_INPUT_TARGET says which (libFuzzer owns the arguments). One
// program for all, because each would be linked from the same 45 MB. With --make-seeds=FOLDER it writes the target's
// seeds into FOLDER, and the words in them as a dictionary beside it, FOLDER.dict, and ends.
#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "tests/input_fuzzing/targets.h"

namespace {

using namespace cutproof::input_fuzzing;

// Words of three letters or more: keywords of a text format, names of fields, attributes and datasets.
std::set<std::string> words_of(const std::vector<std::string>& seeds) {
  std::set<std::string> words;
  for (const std::string& seed : seeds) {
    std::string word;
    for (const char c : seed + ' ') {
      if (std::isalpha(static_cast<unsigned char>(c)) || (c == '_' && !word.empty())) {
        word += c;
        continue;
      }
      if (word.size() >= 3 && word.size() <= 32) words.insert(word);
      word.clear();
    }
  }
  return words;
}

void make_seeds(const Target& target, const std::string& folder) {
  const std::vector<std::string> seeds = target.seeds();
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    std::ofstream(folder + "/seed" + std::to_string(i), std::ios::binary) << seeds[i];
  }
  std::ofstream dictionary(folder + ".dict");
  for (const std::string& word : words_of(seeds)) dictionary << '"' << word << "\"\n";
}

// Never a default: a campaign that feeds another reader than the one it reports on would find nothing, and say so.
const Target& chosen_target() {
  const char* const name = std::getenv("CUTPROOF_INPUT_TARGET");
  const auto found = std::ranges::find(all_targets(), std::string_view(name == nullptr ? "" : name), &Target::name);
  if (found != all_targets().end()) return *found;
  std::fprintf(stderr,
               "input_fuzzer: CUTPROOF_INPUT_TARGET is %s, and has to be one of:", name == nullptr ? "not set" : name);
  for (const Target& target : all_targets()) std::fprintf(stderr, " %s", std::string(target.name).c_str());
  std::fprintf(stderr, "\n");
  std::exit(2);
}

const Target* fed = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  fed = &chosen_target();
  constexpr std::string_view kFlag = "--make-seeds=";
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (!argument.starts_with(kFlag)) continue;
    make_seeds(*fed, std::string(argument.substr(kFlag.size())));
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  // An exception that comes through ends the process, which is what libFuzzer takes for a finding.
  fed->feed({reinterpret_cast<const char*>(data), size});
  return 0;
}
