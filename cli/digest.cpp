// `cutproof digest`: a number for each snapshot of a recording, so that runs on two machines are compared bit by bit
// without moving their recordings.
#include "model/digest.h"

#include <fmt/format.h>

#include <memory>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/recordings.h"
#include "cli/screen.h"
#include "model/io/recording.h"

namespace cutproof::cli {

namespace {

int print_digests(const std::string& recording) {
  const OpenRecording opened = open_recording(recording);
  const io::RecordingReader& reader = *opened.reader;
  Digest all;
  for (int64_t i = 0; i < reader.header().snapshot_count; ++i) {
    const io::Snapshot snapshot = reader.snapshot(i);
    const uint64_t value = digest(snapshot.state);
    say("{:016x}  snapshot {}, {}, frame {}\n", value, i, i == 0 ? "start" : name_of(snapshot.stage),
        snapshot.state.frame - (i > 0 && snapshot.stage == Stage::skin ? 1 : 0));
    all.add(value);
  }
  insist("{:016x}  all {} snapshots\n", all.value(), reader.header().snapshot_count);
  return 0;
}

}  // namespace

void add_digest(CLI::App& program, Work& work) {
  const auto recording = std::make_shared<std::string>();
  CLI::App* const command =
      program.add_subcommand("digest", "print a number per snapshot; equal numbers mean equal bits");
  command->add_option("recording", *recording, "recording of `run --record`")->required()->type_name("F");
  command->callback([recording, &work] { work = [recording] { return print_digests(*recording); }; });
}

}  // namespace cutproof::cli
