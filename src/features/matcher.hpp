#pragma once
#include <span>
#include <vector>
#include <utility>
#include "common/options.hpp"
#include "features/feature_grid.hpp"
namespace ipl_slam {
struct MatchOptions { int max_distance = 60; double ratio = 0.9; template<class V> void visit(V& v){ v.number("max_distance",max_distance,{0,256,"bits","x"}); v.number("ratio",ratio,{0,1,"ratio","x"});} };
struct ProjectedPoint { Eigen::Vector2f uv; float radius; int min_level,max_level; float depth; const Descriptor* descriptor; float angle; };
std::vector<int> match_projected(const Features&, const FeatureGrid&, std::span<const ProjectedPoint>, const MatchOptions&, std::span<const std::uint8_t> taken = {});
std::vector<std::pair<int,int>> match_brute_force(const Features& a, const Features& b, const MatchOptions&);
}
