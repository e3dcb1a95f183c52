#include "client/cli/commands/stored_model_commands.h"

#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>

#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/utf8_check.h"
#include "client/cli/view/stored_model_view.h"

namespace hapticd::cli {
namespace {

void print(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) print_line(line);
}

struct Words {
  std::string hash;
  std::string other;  ///< a second hash, or a tag
  std::string file;
};

CLI::App* add_command(CLI::App& model, const char* name, const char* description, const char* example,
                      const std::shared_ptr<Words>& words) {
  CLI::App* command = model.add_subcommand(name, description);
  command->footer(std::string("Example:\n  ") + example);
  command->add_option("HASH", words->hash, "A stored model: its hash, or the beginning of at least 6 digits")
      ->required();
  return command;
}

/// Writes a temporary file first and renames it: a file of that name is always whole, the old one or the new.
void write_file(const std::string& path, const std::string& text) {
  const std::string temporary = path + ".part";
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  std::error_code failure;
  if (file) std::filesystem::rename(temporary, path, failure);
  if (!file || failure) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw LocalError("cannot write the file", path, failure.message(), "", "check path and permissions");
  }
}

void export_model(Session& session, const Words& words) {
  const auto answer = session.connect().export_stored_model(words.hash);
  if (words.file.empty() || words.file == "-") {
    print_text(answer.json());
    return;
  }
  write_file(words.file, answer.json());
  if (!session.json) print_line("written to {}", words.file);
}

std::string read_input(const std::string& file) {
  const bool is_file = file != "-";
  std::string text =
      is_file ? read_text_file(file) : std::string(std::istreambuf_iterator<char>(std::cin), {});
  require_utf8(text, is_file ? file : "standard input");
  return text;
}

void add_tag_commands(CLI::App& model, Session& session, const std::shared_ptr<Words>& words) {
  CLI::App* tag =
      add_command(model, "tag", "Gives a stored model a tag; scenes use the one tagged \"current\"",
                  "hapticctl model tag 1a2b3c4d5e6f current", words);
  tag->add_option("TAG", words->other,
                  "1 to 64 of a-z A-Z 0-9 _ -; taken from the model of the same kind and object that had it")
      ->required();
  tag->callback([&session, words] {
    const auto answer = session.connect().tag_stored_model(words->hash, words->other);
    if (session.json) return print_json(to_json(answer));
    print_line("{} model {}{} is now '{}'", answer.kind(), short_hash(answer.hash()),
               answer.object().empty() ? "" : " of " + answer.object(), words->other);
    if (words->other == "current") print_line("scenes use it from their next load on");
  });

  CLI::App* untag = add_command(model, "untag", "Takes a tag from a stored model",
                                "hapticctl model untag 1a2b3c4d5e6f current", words);
  untag->add_option("TAG", words->other, "One that it has")->required();
  untag->callback([&session, words] {
    const auto answer = session.connect().untag_stored_model(words->hash, words->other);
    if (session.json) return print_json(to_json(answer));
    print_line("{} has no longer the tag '{}'", short_hash(answer.hash()), words->other);
  });
}

void add_file_commands(CLI::App& model, Session& session, const std::shared_ptr<Words>& words) {
  CLI::App* to_file = add_command(model, "export", "A stored model as JSON, for another daemon",
                                  "hapticctl model export 1a2b3c4d5e6f sponge.json", words);
  to_file->add_option("FILE", words->file, "Where to; without it, or with -, standard output");
  to_file->callback([&session, words] { export_model(session, *words); });

  CLI::App* from_file =
      model.add_subcommand("import", "Stores a model that was exported, under the same hash");
  from_file->footer(
      "Examples:\n  hapticctl model import sponge.json\n"
      "  hapticctl model export 1a2b3c4d5e6f | hapticctl -s other:50051 model import -");
  from_file->add_option("FILE", words->file, "What export wrote; - = standard input")->required();
  from_file->callback([&session, words] {
    const std::string json = read_input(words->file);
    const auto answer = session.connect().import_stored_model(json);
    if (session.json) return print_json(to_json(answer));
    print(stored_model_text(answer, Terminal::detect()));
  });
}

}  // namespace

void list_stored_models(Session& session, const StoredModelFilter& filter) {
  v1::ListStoredModelsRequest request;
  request.set_kind(filter.kind);
  request.set_object(filter.object);
  request.set_tag(filter.tag);
  const auto answer = session.connect().stored_models(request);
  if (session.json) return print_json(to_json(answer));
  print(stored_model_list(answer, Terminal::detect()));
}

bool show_stored_model(Session& session, const std::string& hash) {
  v1::StoredModel model;
  try {
    model = session.connect().stored_model(hash);
  } catch (const client::Error& error) {
    if (error.code() == "NOT_FOUND") return false;
    throw;
  }
  if (session.json) {
    print_json(to_json(model));
  } else {
    print(stored_model_text(model, Terminal::detect()));
  }
  return true;
}

void add_stored_model_commands(CLI::App& model, Session& session) {
  const auto words = std::make_shared<Words>();
  CLI::App* diff = add_command(model, "diff", "Two stored models of one kind, parameter by parameter",
                               "hapticctl model diff 1a2b3c4d5e6f 6f5e4d3c2b1a", words);
  diff->add_option("OTHER", words->other, "Another one of the same kind")->required();
  diff->callback([&session, words] {
    const auto answer = session.connect().diff_stored_models(words->hash, words->other);
    if (session.json) return print_json(to_json(answer));
    print(model_difference_text(answer, Terminal::detect()));
  });

  add_tag_commands(model, session, words);

  CLI::App* erase = add_command(model, "delete", "Deletes a stored model, unless the loaded scene uses it",
                                "hapticctl model delete 1a2b3c4d5e6f", words);
  erase->callback([&session, words] {
    const auto answer = session.connect().delete_stored_model(words->hash);
    if (session.json) return print_json(to_json(answer));
    print_line("deleted {}", answer.hash());
  });

  add_file_commands(model, session, words);
}

}  // namespace hapticd::cli
