#include "tests/measure/report/html_page.h"

#include <algorithm>
#include <fstream>
#include <kainjow/mustache.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/measure/report/markdown_table.h"
#include "tests/measure/report/provenance.h"
#include "tests/measure/report/section.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::report {
namespace {

using Json = nlohmann::ordered_json;
using kainjow::mustache::data;

constexpr const char* kTemplate =
#include "page_template.h"
    ;

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::trunc | std::ios::binary);
  file << text;
  file.flush();
  if (!file) throw std::runtime_error("cannot write '" + path.string() + "'");
}

/// The objects of a file of one JSON object a line; a line cut short is left out.
std::vector<Json> lines_of(const std::filesystem::path& path) {
  std::vector<Json> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    Json json = Json::parse(line, nullptr, false);
    if (json.is_object()) lines.push_back(std::move(json));
  }
  return lines;
}

/// An SVG as the address of an image: what would end the attribute or start an escape is escaped.
std::string image_of(const std::string& svg) {
  constexpr const char* kHex = "0123456789ABCDEF";
  std::string address = "data:image/svg+xml;charset=utf-8,";
  for (const char c : svg) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte >= 0x7F || std::string_view("\"%#<>&'").find(c) != std::string_view::npos) {
      address += '%';
      address += kHex[byte >> 4U];
      address += kHex[byte & 15U];
    } else {
      address += c;
    }
  }
  return address;
}

/// Text without the escapes of Markdown.
std::string plain(std::string text) {
  for (auto at = text.find("\\|"); at != std::string::npos; at = text.find("\\|", at + 1)) text.erase(at, 1);
  return text;
}

bool is_number(const std::string& cell) {
  if (cell == kNoNumber) return true;
  const std::size_t sign = cell.starts_with('-') || cell.starts_with('+') ? 1 : 0;
  return cell.size() > sign && cell[sign] >= '0' && cell[sign] <= '9' && cell.find(' ') == std::string::npos;
}

data table_of(const Json& item) {
  data headers(data::type::list);
  for (const auto& header : item["headers"]) {
    data cell;
    cell.set("cell", plain(header.get<std::string>()));
    headers.push_back(cell);
  }
  data rows(data::type::list);
  for (const auto& row : item["rows"]) {
    data cells(data::type::list);
    for (const auto& text : row) {
      data cell;
      cell.set("cell", plain(text.get<std::string>()));
      cell.set("number", is_number(text.get<std::string>()));
      cells.push_back(cell);
    }
    data line;
    line.set("cells", cells);
    rows.push_back(line);
  }
  data table;
  table.set("title", item.value("title", ""));
  table.set("remark", item.value("remark", ""));
  table.set("headers", headers);
  table.set("rows", rows);
  return table;
}

data plot_of(const Json& item, const std::filesystem::path& folder) {
  data plot;
  plot.set("title", item.value("title", ""));
  const std::string missing = item.value("missing", "");
  if (missing.empty()) {
    plot.set("image", image_of(test::file_text(folder / (item.value("name", "") + ".svg"))));
  } else {
    plot.set("missing", missing);
  }
  return plot;
}

data section_of(const std::vector<Json>& lines, const std::filesystem::path& folder) {
  data section;
  data items(data::type::list);
  for (const Json& line : lines) {
    const std::string kind = line.value("kind", "");
    data item;
    if (kind == "section") {
      section.set("name", line.value("name", ""));
      section.set("title", line.value("title", ""));
      continue;
    }
    if (kind == "text") item.set("text", line.value("text", ""));
    if (kind == "table") item.set("table", table_of(line));
    if (kind == "plot") item.set("plot", plot_of(line, folder));
    items.push_back(item);
  }
  section.set("items", items);
  return section;
}

/// Names of the sections in the folder, in the page's order.
std::vector<std::string> sections_in(const std::filesystem::path& folder,
                                     const std::vector<std::string>& order) {
  std::vector<std::string> found;
  const auto sections = sections_folder(folder);
  if (!std::filesystem::is_directory(sections)) return found;
  for (const auto& entry : std::filesystem::directory_iterator(sections)) {
    if (entry.path().extension() == ".jsonl") found.push_back(entry.path().stem().string());
  }
  std::sort(found.begin(), found.end());
  const auto rank = [&order](const std::string& name) {
    return std::find(order.begin(), order.end(), name) - order.begin();
  };
  std::stable_sort(found.begin(), found.end(),
                   [&rank](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  return found;
}

std::string case_text(const Json& record) {
  std::string text;
  for (const auto& [name, value] : record.at("case").items()) {
    text += (text.empty() ? "" : ", ") + name + " " +
            (value.is_string() ? value.get<std::string>() : value.dump());
  }
  return text;
}

std::string number_text(const Json& record, const char* key) {
  if (!record.contains(key) || record[key].is_null()) return "";
  return record[key].is_number() ? significant(record[key].get<double>(), 4) : record[key].get<std::string>();
}

data figures_of(const std::vector<Json>& records) {
  std::vector<std::string> names;
  std::map<std::string, data> of_name;
  for (const Json& record : records) {
    const std::string name = record.value("figure", "");
    if (!of_name.contains(name)) {
      names.push_back(name);
      of_name.emplace(name, data(data::type::list));
    }
    data row;
    row.set("case", case_text(record));
    row.set("value",
            record.contains("failed") ? record["failed"].get<std::string>() : number_text(record, "value"));
    for (const char* key : {"unit", "run_time_ns", "goal", "reference", "source"})
      row.set(key, number_text(record, key));
    of_name.at(name).push_back(row);
  }
  data figures(data::type::list);
  for (const std::string& name : names) {
    data figure;
    figure.set("figure", name);
    figure.set("count", std::to_string(of_name.at(name).list_value().size()));
    figure.set("records", of_name.at(name));
    figures.push_back(figure);
  }
  return figures;
}

}  // namespace

void write_page(const std::filesystem::path& folder, const PageText& text) {
  const std::vector<Json> records = lines_of(folder / "figures.jsonl");
  Json machine = Json::object();
  data provenance_rows(data::type::list);
  for (const auto& [name, value] : provenance()) {
    machine[name] = value;
    data row;
    row.set("name", name);
    row.set("value", value);
    provenance_rows.push_back(row);
  }
  Json all{{"title", text.title}, {"provenance", machine}, {"sections", Json::array()}, {"figures", records}};
  data sections(data::type::list);
  for (const std::string& name : sections_in(folder, text.order)) {
    const std::vector<Json> lines = lines_of(sections_folder(folder) / (name + ".jsonl"));
    all["sections"].push_back(lines);
    sections.push_back(section_of(lines, folder));
  }
  data page;
  page.set("title", text.title);
  if (!text.readers.empty()) page.set("readers", text.readers);
  page.set("introduction", text.introduction);
  page.set("provenance", provenance_rows);
  page.set("sections", sections);
  page.set("figures", figures_of(records));
  kainjow::mustache::mustache html(kTemplate);
  if (!html.is_valid()) throw std::logic_error("the page's template: " + html.error_message());
  write(folder / "report.html", html.render(page));
  write(folder / "report.json", all.dump(1) + '\n');
}

}  // namespace hapticd::report
