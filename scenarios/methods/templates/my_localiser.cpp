// A localiser in C++: the place whose laser scan looks most like the view's. docs/localiser-protocol.md has the protocol.
//   g++ -O2 -std=c++17 -o my_localiser my_localiser.cpp
//   refseq compare reference.mcap query.mcap --methods ./my_localiser,vlad
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <numeric>
#include <string>
#include <vector>
using Numbers = std::vector<float>;

bool receive(std::string& bytes) { return bool(std::cin.read(bytes.data(), bytes.size())); }

void answer(const std::string& header, const Numbers& numbers = {}) {
    const uint32_t lengths[] = {uint32_t(header.size()), uint32_t(4 * numbers.size())};
    std::cout.write(reinterpret_cast<const char*>(lengths), 8) << header;
    std::cout.write(reinterpret_cast<const char*>(numbers.data()), lengths[1]).flush();
}

Numbers scan_of(const std::string& header, const std::string& payload) {  // [m]; the scan is the end of the payload
    const size_t beams = header.find("\"beams\":");
    Numbers ranges(beams == std::string::npos ? 0 : std::stoul(header.substr(beams + 8)));
    std::memcpy(ranges.data(), payload.data() + payload.size() - 4 * ranges.size(), 4 * ranges.size());
    for (float& range : ranges) range = std::fmin(range, 10);  // nothing returned: infinity
    return ranges;
}

float unlike(const Numbers& a, const Numbers& b) {  // mean difference of the beams [m]
    float sum = 0;
    for (size_t i = 0; i < a.size() && i < b.size(); ++i) sum += std::abs(a[i] - b[i]);
    return a.empty() ? 0 : sum / a.size();
}

int main() {
    std::vector<Numbers> places;
    for (uint32_t lengths[2]; std::cin.read(reinterpret_cast<char*>(lengths), 8);) {
        std::string header(lengths[0], ' '), payload(lengths[1], ' ');
        if (!receive(header) || !receive(payload)) return 1;
        const auto is = [&](const std::string& type) { return header.rfind("{\"type\":\"" + type + '"', 0) == 0; };
        if (is("hello")) answer(R"({"type":"hello","protocol":1,"sensors":["laser"]})");
        else if (is("learn")) places.push_back(scan_of(header, payload));
        else if (is("localise")) {
            const Numbers seen = scan_of(header, payload);
            Numbers weights;
            for (const Numbers& place : places) weights.push_back(std::exp(-unlike(place, seen) / 0.1f));
            const float sum = std::accumulate(weights.begin(), weights.end(), 0.0f);
            for (float& weight : weights) weight /= sum;
            answer(R"({"type":"belief","places":"float32","lost":0.02})", weights);
        } else answer(R"({"type":"ok"})");  // learnt, reset
    }
}
