// Matches a synthetic pair in colour, with a confidence, from buffers whose rows are padded.
// c++ -std=c++17 match.cpp $(pkg-config --cflags --libs bpstereo) -o match && ./match
#include <bpstereo.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

struct Free {
    void operator()(BpstereoMatcher *matcher) const { bpstereo_close(matcher); }
};
using Matcher = std::unique_ptr<BpstereoMatcher, Free>;

static void check(BpstereoStatus status) {
    if (status != BPSTEREO_STATUS_OK) throw std::runtime_error(bpstereo_last_error());
}

static Matcher open(const std::string &options) {
    BpstereoMatcher *matcher = nullptr;
    check(bpstereo_open(options.c_str(), &matcher));
    return Matcher(matcher);
}

int main() try {
    constexpr std::size_t width = 96, height = 64, padding = 7, shift = 5;
    std::vector<std::uint8_t> scene(height * (width + shift) * 3), left, right;
    std::uint32_t noise = 1;
    for (auto &value : scene) value = static_cast<std::uint8_t>((noise = noise * 1664525 + 1013904223) >> 24);
    for (std::size_t y = 0; y < height; ++y) {
        auto row = scene.begin() + static_cast<std::ptrdiff_t>(y * (width + shift) * 3);
        left.insert(left.end(), row, row + width * 3);
        right.insert(right.end(), row + shift * 3, row + (width + shift) * 3);
        left.resize(left.size() + padding);
        right.resize(right.size() + padding);
    }
    constexpr std::ptrdiff_t stride = width * 3 + padding;
    const BpstereoImage one{left.data(), BPSTEREO_VALUE_U8, width, height, 3, stride};
    const BpstereoImage other{right.data(), BPSTEREO_VALUE_U8, width, height, 3, stride};

    std::vector<float> disparity(width * height), confidence(width * height);
    auto matcher = open(R"({"labels": {"count": 16}, "confidence": true})");
    check(bpstereo_compute(matcher.get(), &one, &other, disparity.data(), confidence.data(), width * sizeof(float)));
    const std::size_t centre = height / 2 * width + width / 2;
    std::printf("bpstereo %s: %.2f px at the centre, confidence %.2f\n", bpstereo_version(), disparity[centre], confidence[centre]);
    return std::abs(disparity[centre] - float(shift)) < 0.2f ? 0 : 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "match: %s\n", error.what());
    return 1;
}
