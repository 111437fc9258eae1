#include "model/io/recording_format.h"

#include "model/io/recording.h"

namespace cutproof::io {

std::string stem_of(const std::string& name) {
  return name.ends_with(kIndexSuffix) ? name.substr(0, name.size() - kIndexSuffix.size()) : name;
}

RecordingPaths recording_paths(const std::string& name) {
  const std::string stem = stem_of(name);
  return {stem + std::string(kIndexSuffix), stem + ".particles.vtkhdf", stem + ".skin.vtkhdf", stem + ".blade.vtkhdf"};
}

}  // namespace cutproof::io
