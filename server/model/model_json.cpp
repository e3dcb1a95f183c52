#include "server/model/model_json.h"

#include <utility>
#include <vector>

#include "server/model/canonical_text.h"
#include "server/model/model_archive.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

using model_archive::Reader;
using model_archive::Writer;

constexpr std::string_view kExportSchema = "hapticd.stored_model/1";
constexpr std::size_t kMaxImport = 1 << 20;
constexpr std::size_t kMaxText = 4096;
constexpr std::size_t kMaxParameters = 1024;

/// Checks what rt::check() does not: texts and names.
std::optional<hal::Error> check_texts(const rt::IdentifiedModel& model, const std::string& where) {
  if (rt::is_of_object(model.content)) {
    if (auto error = check_name("model", model.object, where + ", object")) return error;
  } else if (!model.object.empty()) {
    return hal::Error::of(hal::ErrorCode::kMisplacedKey, "a model of the rig has no object", where,
                          model.object, "", "leave the object out");
  }
  if (model.parameters.size() > kMaxParameters) {
    return hal::Error::of(hal::ErrorCode::kTooLong, "too many parameters", where,
                          std::to_string(model.parameters.size()),
                          "at most " + std::to_string(kMaxParameters), "");
  }
  std::vector<const std::string*> texts{&model.device, &model.sensor, &model.procedure,
                                        &model.data_reference};
  for (const rt::EstimatedParameter& parameter : model.parameters) {
    texts.push_back(&parameter.name);
    texts.push_back(&parameter.unit);
  }
  for (const std::string* text : texts) {
    if (text->size() > kMaxText) {
      return hal::Error::of(hal::ErrorCode::kTooLong, "a text is too long", where, text->substr(0, 60) + "…",
                            "at most " + std::to_string(kMaxText) + " bytes", "shorten it");
    }
  }
  return std::nullopt;
}

std::optional<hal::Error> check_all(const rt::IdentifiedModel& model, const std::string& where) {
  if (auto error = rt::check(model)) {
    if (!where.empty()) error->where = where + ", " + error->where;
    return error;
  }
  return check_texts(model, where.empty() ? std::string("identified model") : where);
}

hal::Result<rt::IdentifiedModel> read_model(const Json& json, const std::string& where) {
  rt::IdentifiedModel model;
  model_archive::Complaint complaint;
  Reader reader(json, "", complaint);
  describe(reader, model);
  reader.finish();
  if (!complaint.what.empty()) return not_a_model(complaint.code, complaint.what, where);
  if (auto error = check_all(model, where)) return *error;
  return model;
}

}  // namespace

hal::Result<std::string> canonical_json(const rt::IdentifiedModel& model) {
  if (auto error = check_all(model, {})) return *error;
  Writer writer;
  describe(writer, const_cast<rt::IdentifiedModel&>(model));
  try {
    return canonical_text(writer.json);
  } catch (const Json::exception&) {
    return hal::Error::of(hal::ErrorCode::kSyntax, "a text of the model is not UTF-8",
                          std::string(rt::kind_name(model.content)) + " model", "", "UTF-8",
                          "give object, procedure and data reference as UTF-8");
  }
}

hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& where) {
  const auto parsed = parse_json(json, where);
  if (!parsed) return parsed.error();
  return read_model(*parsed, where);
}

hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& hash,
                                                      const std::string& where) {
  if (const std::string found = sha256_hex(json); found != hash) {
    return hal::Error::of(hal::ErrorCode::kDamaged, "the content of a model does not fit its hash", where,
                          found, hash, "it was altered or damaged: import it again from an export");
  }
  return parse_canonical_json(json, where);
}

std::string export_json(std::string_view canonical, const std::string& hash) {
  // The content is there as it was hashed, one long line: so that it is not fixed by hand.
  return "{\n  \"schema\": \"" + std::string(kExportSchema) + "\",\n  \"hash\": \"" + hash +
         "\",\n  \"model\": " + std::string(canonical) + "\n}\n";
}

hal::Result<ImportedModel> import_json(std::string_view json) {
  const std::string where = "imported model";
  if (json.size() > kMaxImport) {
    return not_a_model(hal::ErrorCode::kTooLong, "too large to be a model", where,
                       std::to_string(json.size()) + " bytes",
                       "at most " + std::to_string(kMaxImport) + " bytes");
  }
  const auto parsed = parse_json(json, where);
  if (!parsed) return parsed.error();
  const Json& document = *parsed;
  const auto text = [&document](const char* key) {
    const auto found = document.is_object() ? document.find(key) : document.end();
    return found != document.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  if (text("schema") != kExportSchema) {
    return not_a_model(hal::ErrorCode::kUnknownWord, "not an exported model, or of another version", where,
                       "schema \"" + text("schema") + "\"", "schema \"" + std::string(kExportSchema) + "\"");
  }
  const auto content = document.find("model");
  if (content == document.end() || !content->is_object() || text("hash").empty()) {
    return not_a_model(hal::ErrorCode::kMissingKey, "'hash' or 'model' is missing", where);
  }
  ImportedModel imported;
  imported.canonical = canonical_text(*content);
  imported.hash = sha256_hex(imported.canonical);
  if (imported.hash != text("hash")) {
    return not_a_model(hal::ErrorCode::kDamaged,
                       "the content does not fit its hash: it was altered or damaged on the way", where,
                       imported.hash, text("hash"));
  }
  auto model = read_model(*content, where);
  if (!model) return model.error();
  // A text that is read as a model but written differently would be stored under another hash.
  const auto again = canonical_json(*model);
  if (!again) return again.error();
  if (*again != imported.canonical)
    return not_a_model(hal::ErrorCode::kMalformed, "not in canonical form", where);
  imported.model = std::move(*model);
  return imported;
}

}  // namespace hapticd::server
