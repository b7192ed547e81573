// The C interface: models from JSON files, errors as sentences.

#include "dustfall.h"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <locale>
#include <map>
#include <new>
#include <numeric>

#include "dustfall/force_model.hpp"
#include "dustfall/nearest_neighbours.hpp"

struct dustfall_model : dustfall::ForceModel {
    using dustfall::ForceModel::ForceModel;
};

namespace {

// What model files need of JSON: objects of texts, numbers, arrays of numbers, and objects.
class JsonObject {
public:
    static JsonObject read(const std::string& path) {
        std::ifstream file(path);
        if (!file) throw std::invalid_argument("there is no file " + path + " that can be read");
        const std::string content((std::istreambuf_iterator<char>(file)),
                                  std::istreambuf_iterator<char>());
        const char* place = content.c_str();
        const JsonObject object(place, 0);
        skip_blanks(place);
        if (place != content.c_str() + content.size()) damaged();
        return object;
    }

    std::string text(const char* key) const { return entry(texts_, key); }
    double number(const char* key) const { return entry(numbers_, key); }
    std::vector<double> numbers(const char* key) const { return entry(arrays_, key); }
    JsonObject child(const char* key) const { return entry(children_, key); }

private:
    static const int DEEPEST = 2;  // a file holds networks, and these hold blocks

    std::map<std::string, std::string> texts_;
    std::map<std::string, double> numbers_;
    std::map<std::string, std::vector<double>> arrays_;
    std::map<std::string, JsonObject> children_;

    JsonObject(const char*& place, int depth) {
        if (depth > DEEPEST) damaged();
        expect(place, '{');
        do {
            const std::string key = quoted(place);
            expect(place, ':');
            skip_blanks(place);
            if (*place == '"') {
                texts_[key] = quoted(place);
            } else if (*place == '{') {
                children_.emplace(key, JsonObject(place, depth + 1));
            } else if (*place == '[') {
                arrays_[key] = array(place);
            } else {
                numbers_[key] = value(place);
            }
        } while (follows(place, ','));
        expect(place, '}');
    }

    template <class Value>
    static Value entry(const std::map<std::string, Value>& entries, const char* key) {
        const auto found = entries.find(key);
        if (found == entries.end())
            throw std::invalid_argument(std::string("the force model's file has no ") + key);
        return found->second;
    }

    static std::vector<double> array(const char*& place) {
        std::vector<double> values;
        expect(place, '[');
        if (follows(place, ']')) return values;
        do values.push_back(value(place));
        while (follows(place, ','));
        expect(place, ']');
        return values;
    }

    static double value(const char*& place) {
        skip_blanks(place);
        const std::size_t length = std::strspn(place, "+-.0123456789eE");
        // A stream of its own, because strtod follows the locale of the calling program.
        std::istringstream stream(std::string(place, length));
        stream.imbue(std::locale::classic());
        double result;
        if (!(stream >> result) || stream.peek() != EOF) damaged();
        place += length;
        return result;
    }

    static std::string quoted(const char*& place) {
        expect(place, '"');
        const char* begin = place;
        while (*place != '"') {
            if (*place == '\0' || *place == '\\') damaged();
            ++place;
        }
        return std::string(begin, place++);
    }

    static void skip_blanks(const char*& place) {
        while (*place == ' ' || *place == '\t' || *place == '\n' || *place == '\r') ++place;
    }

    static bool follows(const char*& place, char character) {
        skip_blanks(place);
        if (*place != character) return false;
        ++place;
        return true;
    }

    static void expect(const char*& place, char character) {
        if (!follows(place, character)) damaged();
    }

    [[noreturn]] static void damaged() {
        throw std::invalid_argument("the force model's file is damaged or no JSON");
    }
};

std::string& last_error() {
    static thread_local std::string sentence;
    return sentence;
}

// Runs a piece of work; returns whether it failed, with the sentence kept.
template <class Work>
int failed(Work work) {
    try {
        work();
        return 0;
    } catch (const std::bad_alloc&) {
        last_error() = "not enough memory";
    } catch (const std::exception& error) {
        last_error() = error.what();
    }
    return 1;
}

std::size_t checked(std::int64_t count) {
    if (count < 0) throw std::invalid_argument("a count is negative");
    return static_cast<std::size_t>(count);
}

}  // namespace

dustfall_model* dustfall_load(const char* path) {
    dustfall_model* model = nullptr;
    failed([&] { model = new dustfall_model(JsonObject::read(path)); });
    return model;
}

void dustfall_free(dustfall_model* model) { delete model; }

int dustfall_neighbours(const dustfall_model* model) { return model->neighbours(); }
const char* dustfall_name(const dustfall_model* model) { return model->name().c_str(); }
const char* dustfall_hash(const dustfall_model* model) { return model->hash().c_str(); }

int dustfall_predict(const dustfall_model* model, int64_t count, const double* neighbours,
                     double* force) {
    return failed([&] { model->predict(checked(count), neighbours, force); });
}

int dustfall_drag(const dustfall_model* model, int64_t count, const double* flow,
                  const double* neighbours, const double* at_rest, double* beta, double* side) {
    return failed(
        [&] { model->drag(checked(count), flow, neighbours, at_rest, beta, side); });
}

int dustfall_nearest(int64_t count, const double* positions, const double* period, int number,
                     double* vectors, int64_t* rows) {
    return failed([&] {
        const std::size_t points = checked(count);
        if (number < 1 || points < static_cast<std::size_t>(number) + 1)
            throw std::invalid_argument(
                "at least one neighbour, and one point more than neighbours, are needed");
        std::vector<std::int64_t> keys(points);
        std::iota(keys.begin(), keys.end(), 0);
        const dustfall::NearestNeighbours search(points, positions, keys.data(), period);
        std::vector<dustfall::NearestNeighbours::Neighbour> found(number);
        for (const std::size_t i : search.order()) {
            search.find(i, number, found.data());
            for (int j = 0; j < number; ++j) {
                rows[number * i + j] = static_cast<std::int64_t>(found[j].point);
                search.separation(i, found[j].point, vectors + 3 * (number * i + j));
            }
        }
    });
}

const char* dustfall_error(void) { return last_error().c_str(); }
