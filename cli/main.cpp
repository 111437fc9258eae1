#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <sstream>
#include <string>

#include "cli/commands.h"
#include "cli/help.h"
#include "cli/interruption.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/printable_output.h"
#include "cli/screen.h"
#include "cli/usage.h"
#include "guests/guest.h"
#include "model/backend.h"
#include "model/error.h"
#include "model/io/unfinished.h"

namespace {

// Not fmt::print, which may need memory that is not there.
int say(const char* what, int status) {
  std::fflush(stdout);
  cutproof::cli::print_error({"cutproof: ", what, "\n"});
  return status;
}

// Exit status 2: bad input, 3: the machine failed. Requires an exception in flight.
int status_of_exception() noexcept {
  try {
    throw;
  } catch (const cutproof::InputError& error) {
    return say(error.what(), 2);
  } catch (const cutproof::Refused& error) {
    return say((std::string("nothing was judged: ") + error.what()).c_str(), 1);
  } catch (const cutproof::guests::CannotRunHere& error) {
    return say((std::string("skipped: ") + error.what()).c_str(), 77);
  } catch (const std::bad_alloc&) {
    return say("the machine does not have enough memory for this", 3);
  } catch (const std::exception& error) {
    return say(error.what(), 3);
  } catch (...) {
    return say("an unknown exception was thrown: a defect of this program", 3);
  }
}

// Destructors that run out of memory end here, because they cannot throw: nlohmann::json allocates a stack to destroy
// its values.
[[noreturn]] void end_with_status() {
  const int status = std::current_exception() != nullptr ? status_of_exception() : say("a defect of this program", 3);
  std::fflush(stdout);
  cutproof::io::Unfinished::remove_all();
  std::_Exit(status);
}

int run_command_line(int argc, char** argv) {
  using namespace cutproof::cli;
  CLI::App app{
      "cutproof judges soft-body dissection: it cuts a body made of shape matching clusters and certifies every "
      "frame.\nExit status: 0 everything holds, 1 a verdict failed or nothing was judged, 2 bad input or usage, 3 the "
      "machine failed, 77 a plugin cannot run here."};
  app.set_version_flag("--version", std::string("cutproof ") + kVersion);
  app.require_subcommand(1);
  Work work;
  for (const auto add : {add_run, add_judge, add_check, add_kick, add_relate, add_vectors, add_check_vectors, add_info,
                         add_bench, add_tune, add_fuzz, add_replay, add_report, add_digest})
    add(app, work);
  AskedStyle asked_style;
  add_style(app, asked_style);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(help_page(app).c_str(), stdout);
    return 0;
  } catch (const CLI::Success& asked) {  // --version
    std::ostringstream text;
    const int status = app.exit(asked, text, text);
    std::fputs(text.str().c_str(), stdout);
    return status;
  } catch (const CLI::ParseError& error) {
    if (argc <= 1) {
      std::fputs(help_page(app).c_str(), stderr);
    } else {
      say(usage_error(app, error, {argv + 1, argv + argc}).c_str(), 2);
    }
    return 2;
  }
  refuse_odd_words(app);
  divert_standard_output(app);
  set_style(settled(asked_style, isatty(STDOUT_FILENO) != 0));
  if (style().colour) let_colours_through();
  return work();
}

}  // namespace

int main(int argc, char** argv) {
  std::set_terminate(end_with_status);
  cutproof::cli::handle_signals();
  try {
    cutproof::cli::make_output_printable();
    const int status = run_command_line(argc, argv);
    if (cutproof::cli::stop_asked()) {
      std::fflush(stdout);
      cutproof::cli::end_by_signal();
    }
    cutproof::cli::flush_output();
    return status;
  } catch (...) {
    const int status = status_of_exception();
    if (cutproof::cli::stop_asked()) cutproof::cli::end_by_signal();
    return status;
  }
}
