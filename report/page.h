// A report: one HTML file that a browser opens without anything beside it, and without a network.
#pragma once
#include <cstdint>
#include <string>

#include "report/beside.h"
#include "report/html.h"
#include "report/pictures.h"
#include "report/results.h"

namespace cutproof::report {

// Whether this build makes pages: it had esbuild and three.js, of which they are made.
bool has_pages();
// Throws InputError, naming `option`, in a build without them.
void require_pages(const std::string& option);

// About as much of a page is particles and skin at most.
inline constexpr int64_t kMostPictureBytes = int64_t{28} << 20;

// The page as text. `again`: the command line that judges it again. `beside`: another run of the same body, shown or
// measured beside the one that the page is about; or null.
std::string page(const Source& source, const Results& results, const std::string& again, const Made& made,
                 const Beside* beside = nullptr, int64_t most_picture_bytes = kMostPictureBytes);
// Throws InputError naming `other_file` if the two do not hold the same body: as many particles, in the same places at
// rest, with the same edges.
void require_same_body(const io::Recording& recording, const std::string& recording_file, const io::Recording& other,
                       const std::string& other_file);
// Throws InputError if these are not the results of that recording. `scene`: its name in the recording, empty if that
// does not say.
void require_same_run(const io::Recording& recording, const std::string& scene, const std::string& recording_file,
                      const Results& results, const std::string& results_file);

// The results of a recording that nobody judged.
Results unjudged(const io::Recording& recording, const std::string& scene);

}  // namespace cutproof::report
