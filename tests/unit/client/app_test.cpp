#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/commands/bash_completion.h"
#include "client/cli/commands/commands.h"
#include "client/cli/text/report.h"
#include "client/cli/text/usage_error.h"
#include "client/cli/text/utf8_check.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

struct Built {
  Session session{.server = "127.0.0.1:50051"};
  CLI::App app;
  Built() {
    app.name("hapticctl");
    build_app(app, session);
    require_utf8_options(app);
  }
};

void visit(const CLI::App& app, const std::function<void(const CLI::App&)>& visitor) {
  visitor(app);
  for (const CLI::App* sub : app.get_subcommands(nullptr)) visit(*sub, visitor);
}

TEST(App, EveryCommandHasADescriptionAndAnExample) {
  Built built;
  visit(built.app, [](const CLI::App& command) {
    EXPECT_NE(command.get_description(), "") << command.get_name();
    const bool leads_on = !command.get_subcommands(nullptr).empty();
    if (!leads_on) {
      EXPECT_NE(command.get_footer().find("xample"), std::string::npos) << command.get_name();
    }
    for (const CLI::Option* option : command.get_options()) {
      EXPECT_NE(option->get_description(), "") << command.get_name() << " " << option->get_name();
    }
  });
}

/// Every command that does something, as it is typed: "target set".
std::vector<std::string> commands_of(const CLI::App& app, const std::string& above = {}) {
  std::vector<std::string> commands;
  for (const CLI::App* sub : app.get_subcommands(nullptr)) {
    const std::string typed = above.empty() ? sub->get_name() : above + " " + sub->get_name();
    const std::vector<std::string> below = commands_of(*sub, typed);
    if (below.empty()) commands.push_back(typed);
    commands.insert(commands.end(), below.begin(), below.end());
  }
  return commands;
}

std::string page(const char* name) {
  return test::file_text(std::string(SOURCE_FOLDER "/docs/") + name);
}

TEST(App, ThePagesOfTheCommandsHaveEveryCommand) {
  Built built;
  const std::string pages = page("commands.md") + page("identification.md");
  for (const std::string& command : commands_of(built.app)) {
    EXPECT_TRUE(std::regex_search(pages, std::regex("(`|hapticctl )" + command + "\\b"))) << command;
  }
}

TEST(App, ThePageOfTheCommandsHasNoOtherCommand) {
  Built built;
  const std::string text = page("commands.md");
  const std::size_t begin = text.find("| command | what it does |");
  ASSERT_NE(begin, std::string::npos);
  const std::string table = text.substr(begin, text.find("\n\n", begin) - begin);
  const std::vector<std::string> commands = commands_of(built.app);
  const auto is_there = [&commands](const std::string& words) {
    return std::any_of(commands.begin(), commands.end(),
                       [&words](const std::string& c) { return (c + " ").starts_with(words + " "); });
  };
  const std::regex row("\n\\| ([^|]*)");
  const std::regex named("`([a-z]+( [a-z]+)*)");
  for (std::sregex_iterator cell(table.begin(), table.end(), row), last; cell != last; ++cell) {
    const std::string first_cell = (*cell)[1];
    for (std::sregex_iterator word(first_cell.begin(), first_cell.end(), named); word != last; ++word) {
      EXPECT_TRUE(is_there((*word)[1])) << (*word)[1];
    }
  }
}

/// The command that is typed so, or the one it leads to.
const CLI::App* command_of(const CLI::App& app, const std::string& typed) {
  const CLI::App* command = &app;
  std::istringstream words(typed);
  for (std::string word; words >> word;) {
    const CLI::App* below = nullptr;
    for (const CLI::App* sub : command->get_subcommands(nullptr)) {
      if (sub->get_name() == word) below = sub;
    }
    if (below == nullptr) break;  // an argument
    command = below;
  }
  return command;
}

TEST(App, EveryOptionInThePageOfTheCommandsIsOneOfItsCommand) {
  Built built;
  const std::string text = page("commands.md");
  std::istringstream lines(text.substr(text.find("| command | what it does |")));
  std::string line;
  int options = 0;
  while (std::getline(lines, line) && line.starts_with("|")) {
    std::vector<const CLI::App*> commands;
    const std::regex code("`([^`]*)`");
    for (std::sregex_iterator word(line.begin(), line.end(), code), last; word != last; ++word) {
      const CLI::App* command = command_of(built.app, (*word)[1]);
      if (command != &built.app) commands.push_back(command);
    }
    const std::regex named("--[a-z][a-z-]*");
    for (std::sregex_iterator word(line.begin(), line.end(), named), last; word != last; ++word) {
      ++options;
      EXPECT_TRUE(std::any_of(
          commands.begin(), commands.end(),
          [&word](const CLI::App* command) { return command->get_option_no_throw(word->str()) != nullptr; }))
          << word->str() << " in: " << line;
    }
  }
  EXPECT_GT(options, 10);
}

TEST(App, ACommandWithCommandsBelowItListsThemAndVersionPrintsTheVersion) {
  Built built;
  const CLI::App* target = built.app.get_subcommand("target");
  EXPECT_NE(target->get_footer().find("hapticctl target get --help"), std::string::npos)
      << target->get_footer();
  EXPECT_EQ(target->get_footer().find("telemetry"), std::string::npos) << target->get_footer();
  EXPECT_THROW(built.app.parse("--version"), CLI::CallForVersion);
}

TEST(App, TheCompletionScriptWorksInBash) {
  Built built;
  const test::TemporaryFolder folder;
  const std::string path = folder.write("hapticctl_completion.bash", bash_completion(built.app));
  const auto completes = [&path](const std::string& words, const std::string& last,
                                 const std::string& expected) {
    const std::string program =
        "source " + path + "; COMP_WORDS=(hapticctl " + words + " '" + last +
        "'); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _hapticctl; [[ \" ${COMPREPLY[*]} \" == *' " + expected +
        " '* ]]";
    return std::system(("bash -c '" +
                        [&] {
                          std::string quoted;
                          for (const char c : program)
                            quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
                          return quoted;
                        }() +
                        "'")
                           .c_str()) == 0;
  };
  EXPECT_NE(test::file_text(path).find("complete -o default"), std::string::npos)
      << "else no file is completed";
  EXPECT_TRUE(completes("", "sta", "status"));
  EXPECT_TRUE(completes("sim hand", "pr", "press"));
  EXPECT_TRUE(completes("--server unix:/x target", "", "set"));
  EXPECT_TRUE(completes("telemetry record", "--sec", "--seconds"));
  EXPECT_TRUE(completes("model", "sh", "show"));
  EXPECT_TRUE(completes("identify", "inc", "inclusion"));
  EXPECT_TRUE(completes("identify contact --object sponge", "--la", "--law"));
  EXPECT_TRUE(completes("sim hand press", "--js", "--json"));
  EXPECT_TRUE(completes("target set --position-profile -20:0.3,20:0.8", "--ax", "--axis"));
  EXPECT_TRUE(completes("scene explain --model foam_ball_3d", "--ti", "--timeout"));
  EXPECT_FALSE(completes("telemetry", "", "press"));
}

TEST(App, ARangeIsCheckedBeforeAnyCall) {
  Built built;
  EXPECT_THROW(built.app.parse("target set 0.5 --in 61", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("telemetry watch --decimation 0", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("target set 0.5 --in 1 --at-ns 5", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("no_such_command", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("target set 0.5 --hunt-crossley 1,0,1", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("target set 0.5 --axis x", false), CLI::ParseError);
  EXPECT_THROW(built.app.parse("target set --displacement-profile 0:1 --position-profile 0:1", false),
               CLI::ParseError);
}

/// Returns the error of a line that is refused.
v1::ErrorDetail detail_of(const std::string& line) {
  Built built;
  try {
    built.app.parse(line, false);
  } catch (const CLI::ParseError& error) {
    return usage_error(built.app, error).detail();
  }
  ADD_FAILURE() << "it is accepted: " << line;
  return {};
}

TEST(App, AMistypedWordIsNamedWithWhatWasMeant) {
  struct Case {
    const char* line;
    const char* what;
    const char* where;
    const char* value;
    const char* remedy;
  };
  for (const Case& one : std::vector<Case>{
           {"traget set 3", "there is no such command", "hapticctl", "traget", "did you mean 'target'?"},
           {"sim hand pres", "there is no such command", "hapticctl sim hand", "pres",
            "did you mean 'press'?"},
           {"--json recrod list", "there is no such command", "hapticctl", "recrod",
            "did you mean 'record'?"},
           {"lease", "a command is missing", "hapticctl lease", "", "hapticctl lease --help"},
           {"qqq", "there is no such command", "hapticctl", "qqq", "hapticctl --help"},
           {"target set 0.3 --rmap 1", "there is no such option", "hapticctl target set", "--rmap",
            "did you mean '--ramp'?"},
           {"scene list more", "this is one word too many", "hapticctl scene list", "more",
            "hapticctl scene list --help"},
           {"target set 0.3 --rmap 2s", "there is no such option", "hapticctl target set", "--rmap",
            "did you mean '--ramp'?"}}) {
    const v1::ErrorDetail detail = detail_of(one.line);
    EXPECT_EQ(detail.what(), one.what) << one.line;
    EXPECT_EQ(detail.where(), one.where) << one.line;
    EXPECT_EQ(detail.value(), one.value) << one.line;
    EXPECT_EQ(detail.remedy(), one.remedy) << one.line;
  }
}

TEST(App, AValueThatCannotBeIsNamedWithWhatIsPossible) {
  struct Case {
    const char* line;
    const char* what;
    const char* where;
    const char* value;
    const char* limit;
    v1::ErrorReason reason;
    std::string remedy = {};  ///< empty: the help of the command
  };
  constexpr auto kInvalid = v1::ERROR_REASON_INVALID;
  constexpr auto kRange = v1::ERROR_REASON_OUT_OF_RANGE;
  constexpr const char* kNoNumber = "this is not a number";
  constexpr const char* kNotInRange = "this is out of range";
  for (const Case& one : std::vector<Case>{
           {"target set abc", kNoNumber, "target set N_PER_MM", "abc",
            "a number with a point, in N/mm, such as 0.3", kInvalid},
           {"target set 0,3", kNoNumber, "target set N_PER_MM", "0,3",
            "a number with a point, in N/mm, such as 0.3", kInvalid, "did you mean '0.3'?"},
           {"target set 0.3N/mm", kNoNumber, "target set N_PER_MM", "0.3N/mm",
            "a number with a point, in N/mm, such as 0.3", kInvalid, "did you mean '0.3'?"},
           {"target set 0.3 --ramp 2s", kNoNumber, "target set --ramp", "2s",
            "a number with a point, in s, such as 0.3", kInvalid, "did you mean '2'?"},
           {"target set 0.3 --at-ns 0.5", "this is not a whole number", "target set --at-ns", "0.5",
            "a whole number, in ns, such as 3", kInvalid},
           {"sim hand press --force 2000mN", kNoNumber, "sim hand press --force", "2000mN",
            "a number with a point, in N, such as 0.3", kInvalid},
           {"identify contact --object a --force 2000mN", kNoNumber, "identify contact --force", "2000mN",
            "a number with a point, in N, 0.2 … 30", kInvalid},
           {"identify contact --object a --displacement -1", kNotInRange, "identify contact --displacement",
            "-1", "greater than 0 mm", kRange},
           {"identify contact --object a --speed 0", kNotInRange, "identify contact --speed", "0",
            "greater than 0 mm/s", kRange},
           {"turntable move 45 --acceleration 0", kNotInRange, "turntable move --acceleration", "0",
            "greater than 0 deg/s²", kRange},
           {"telemetry watch --seconds -1", kNotInRange, "telemetry watch --seconds", "-1", "0 s or more",
            kRange},
           {"telemetry watch --decimation 0", kNotInRange, "telemetry watch --decimation", "0", "1 … 10000",
            kRange},
           {"identify structural --rigid --least-object-stiffness 1", kNotInRange,
            "identify structural --least-object-stiffness", "1", "10 … 1000000 N/mm", kRange},
           {"lease hold --ttl 100 -- true", kNotInRange, "lease hold --ttl", "100", "1 … 60 s", kRange},
           {"lease hold --take -- true", "this cannot be read", "lease hold --take", "--", "WHY", kInvalid},
           {"status --timeout 0", kNotInRange, "status --timeout", "0", "0.01 … 3600 s", kRange},
           {"identify contact --object a --law crep", "this is not one of the accepted words",
            "identify contact --law", "crep", "hunt_crossley, creep", v1::ERROR_REASON_UNKNOWN_WORD,
            "did you mean 'creep'?"},
           {"record start press --note M\xFCller", "this is not UTF-8", "record start --note",
            "M\xEF\xBF\xBDller", "text in UTF-8", kInvalid,
            "type it where the locale is one of UTF-8, e.g. LC_ALL=C.UTF-8"},
           {"record start M\xFCller", "this is not UTF-8", "record start NAME", "M\xEF\xBF\xBDller",
            "text in UTF-8", kInvalid, "type it where the locale is one of UTF-8, e.g. LC_ALL=C.UTF-8"},
           {"identify contact --object a --press-direction 0,0,x", "this cannot be read",
            "identify contact --press-direction", "0,0,x", "X,Y,Z", kInvalid}}) {
    SCOPED_TRACE(one.line);
    const v1::ErrorDetail detail = detail_of(one.line);
    const std::string where = std::string("hapticctl ") + one.where;
    EXPECT_EQ(detail.what(), one.what);
    EXPECT_EQ(detail.where(), where);
    EXPECT_EQ(detail.value(), one.value);
    EXPECT_EQ(detail.limit(), one.limit);
    EXPECT_EQ(detail.reason(), one.reason);
    EXPECT_EQ(detail.remedy(),
              one.remedy.empty() ? where.substr(0, where.rfind(' ')) + " --help" : one.remedy);
  }
}

TEST(App, AFileThatIsNotUtf8IsNamedWithItsLine) {
  struct Case {
    std::string text;
    const char* what;
    const char* line;
    const char* value;
  };
  const test::TemporaryFolder folder;
  const std::string utf16("\xFF\xFEn\0a\0", 6);
  for (const Case& one :
       {Case{"name = \"a\"\n# M\xFCller\n", "this is not UTF-8", "2", "# M\xEF\xBF\xBDller"},
        Case{"# M\xFCller", "this is not UTF-8", "1", "# M\xEF\xBF\xBDller"},
        Case{utf16, "this is UTF-16, not UTF-8", "1", ""}}) {
    const std::string file = folder.write("bad.toml", one.text);
    for (const char* command : {"scene explain ", "scene load ", "model import "}) {
      SCOPED_TRACE(command + one.text);
      Built built;
      built.session.server = "unix:/nonexistent/hapticd.sock";
      const LocalError error = test::thrown_by<LocalError>([&] { built.app.parse(command + file, false); });
      EXPECT_EQ(error.detail().what(), one.what);
      EXPECT_EQ(error.detail().where(), file + ", line " + one.line);
      EXPECT_EQ(error.detail().value(), one.value);
    }
  }
}

TEST(App, AnUnusableTargetIsReportedBeforeAnyCall) {
  for (const char* line :
       {"target set", "target set --hunt-crossley 1", "target set --position-profile -20:x",
        "target set --position-profile -20:0.3,20:0.8 --axis w"}) {
    Built built;
    EXPECT_THROW(built.app.parse(line, false), LocalError) << line;
  }
}

TEST(App, AnAddressWithoutADaemonIsReported) {
  Built built;
  built.session.timeout_s = 2.0;
  const client::Error error = test::thrown_by<client::Error>(
      [&] { built.app.parse("status --server unix:/nonexistent/hapticd.sock", false); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kUnreachable);
  EXPECT_EQ(report(error, built.session), ExitCode::kUnreachable);
}

}  // namespace
}  // namespace hapticd::cli
