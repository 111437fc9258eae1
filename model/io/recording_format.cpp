#include "model/io/recording_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <type_traits>

#include "model/io/recording.h"
#include "model/io/recording_archive.h"

namespace cutproof::io {

const std::vector<RecordedField>& recorded_fields() {
  static const std::vector<RecordedField> fields = [] {
    std::vector<RecordedField> all;
    for_each_field([&]<class Get>(const Field& field, Get) {
      using T = std::remove_cvref_t<std::invoke_result_t<Get, State&>>;
      if constexpr (is_vector<T>) {
        const Storage storage = field.space == IndexSpace::state      ? Storage::list
                                : field.space == IndexSpace::triangle ? Storage::cells
                                                                      : Storage::rows;
        all.push_back({field, storage, hdf5::layout_of<typename T::value_type>(),
                       [](const State& state) { return std::as_bytes(std::span(Get{}(state))); },
                       [](State& state, int64_t entries) {
                         Get{}(state).resize(static_cast<std::size_t>(entries));
                         return reinterpret_cast<std::byte*>(Get{}(state).data());
                       }});
      } else {
        all.push_back({field, Storage::value, hdf5::layout_of<T>(),
                       [](const State& state) { return std::as_bytes(std::span(&Get{}(state), 1)); },
                       [](State& state, int64_t) { return reinterpret_cast<std::byte*>(&Get{}(state)); }});
      }
    });
    return all;
  }();
  return fields;
}

std::string stem_of(const std::string& name) {
  return name.ends_with(kIndexSuffix) ? name.substr(0, name.size() - kIndexSuffix.size()) : name;
}

RecordingPaths recording_paths(const std::string& name) {
  const std::string stem = stem_of(name);
  return {stem + std::string(kIndexSuffix), stem + ".particles.vtkhdf", stem + ".skin.vtkhdf", stem + ".blade.vtkhdf"};
}

std::string words_of_stages(const std::array<bool, 6>& stages) {
  std::string words;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    if (stages[s]) words += (words.empty() ? "" : " ") + std::string(kStageNames[s]);
  }
  return words;
}

std::array<bool, 6> stages_of_words(const std::string& words) {
  std::array<bool, 6> stages = {};
  std::istringstream stream(words);
  for (std::string word; stream >> word;) {
    const auto found = std::ranges::find(kStageNames, word);
    if (found == kStageNames.end()) {
      throw hdf5::Error(kLeftToReference, fmt::format("\"{}\" is no stage.", word));
    }
    stages[static_cast<std::size_t>(found - kStageNames.begin())] = true;
  }
  return stages;
}

}  // namespace cutproof::io
