#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

namespace hapticd::test {

/// A file that two processes map, of one layout, which begins with its `kMagic`.
template <class Layout>
class SharedPage {
 public:
  /// Makes the file, all zero but for what `fill` writes, and maps it. Throws std::runtime_error.
  template <class Fill>
  SharedPage(const std::string& path, Fill fill) : path_(path) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0 || ftruncate(file, sizeof(Layout)) != 0) {
      throw std::runtime_error("cannot make the page " + path + ": " + std::strerror(errno));
    }
    map(file);
    fill(*new (layout_) Layout());
    layout_->magic = Layout::kMagic;
  }
  /// A page that another process has made. Throws std::runtime_error.
  struct Join {};
  SharedPage(const std::string& path, Join) : path_(path) {
    const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
    struct stat state {};
    const bool fits = file >= 0 && fstat(file, &state) == 0 && state.st_size == sizeof(Layout);
    if (fits) map(file);
    if (!fits || layout_->magic != Layout::kMagic) throw std::runtime_error(path + " is not a page");
  }
  ~SharedPage() { munmap(layout_, sizeof(Layout)); }
  SharedPage(const SharedPage&) = delete;
  SharedPage& operator=(const SharedPage&) = delete;

  const std::string& path() const { return path_; }
  Layout& operator*() noexcept { return *layout_; }
  Layout* operator->() noexcept { return layout_; }
  const Layout* operator->() const noexcept { return layout_; }

 protected:
  Layout& layout() const noexcept { return *layout_; }

 private:
  void map(int file) {
    void* memory = mmap(nullptr, sizeof(Layout), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) throw std::runtime_error("cannot map the page " + path_);
    layout_ = static_cast<Layout*>(memory);
  }

  std::string path_;
  Layout* layout_ = nullptr;
};

}  // namespace hapticd::test
