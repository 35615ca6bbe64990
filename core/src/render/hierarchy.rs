//! A bounding volume hierarchy over the clusters of a scene, walked from near to far (Kay & Kajiya 1986).

use super::scene::Cluster;

/// Boxes around boxes around clusters, in one array: the first child follows its parent, the second is linked.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    nodes: Vec<Node>,
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// The second child of an inner node, the cluster of a leaf.
    link: u32,
    /// The axis along which the children lie one after the other; [`LEAF`] for a leaf.
    axis: u8,
    /// Where the children part along that axis.
    middle: f32,
}

const LEAF: u8 = 3;

/// A box of offsets from the scene's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest E, N, H.
    pub min: [f32; 3],
    /// Largest E, N, H.
    pub max: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    fn of(cluster: &Cluster) -> Self {
        Self { min: cluster.min, max: cluster.max }
    }

    fn with(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }
}

impl Hierarchy {
    /// The hierarchy over `clusters`, halved along the longest axis of their middles: n·log n.
    pub fn new(clusters: &[Cluster]) -> Self {
        let mut order: Vec<u32> = (0..clusters.len() as u32).collect();
        let mut nodes = Vec::with_capacity(2 * clusters.len());
        if !order.is_empty() {
            add(&mut nodes, clusters, &mut order);
        }
        Self { nodes }
    }

    /// Walks from near `eye` to far: `enter` is called with each box and, at a leaf, the index of its cluster; what lies
    /// in a box that it does not accept is left out. `stack` is scratch space.
    pub fn walk(&self, eye: [f32; 3], stack: &mut Vec<u32>, mut enter: impl FnMut(&Bounds, Option<usize>) -> bool) {
        let mut walk = self.start(eye, stack);
        while let Some(place) = walk.next() {
            if enter(&place.node.bounds, place.cluster()) {
                walk.enter(place);
            }
        }
    }

    /// The same walk, step by step.
    #[inline(always)]
    pub(super) fn start<'a>(&'a self, eye: [f32; 3], stack: &'a mut Vec<u32>) -> Walk<'a> {
        stack.clear();
        stack.extend((!self.nodes.is_empty()).then_some(0));
        Walk { nodes: &self.nodes, eye, stack }
    }
}

/// A walk under way.
pub(super) struct Walk<'a> {
    nodes: &'a [Node],
    eye: [f32; 3],
    stack: &'a mut Vec<u32>,
}

/// A box met on a walk.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    index: u32,
    node: &'a Node,
}

impl<'a> Walk<'a> {
    /// The next box; what lies in it is left out unless it is entered.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<Place<'a>> {
        let index = self.stack.pop()?;
        Some(Place { index, node: &self.nodes[index as usize] })
    }

    /// Takes what lies in the box just met next.
    #[inline(always)]
    pub(super) fn enter(&mut self, Place { index, node }: Place) {
        if node.axis == LEAF {
            return;
        }
        let first_is_near = self.eye[usize::from(node.axis)] < node.middle;
        let [near, far] = if first_is_near { [index + 1, node.link] } else { [node.link, index + 1] };
        self.stack.push(far);
        self.stack.push(near);
    }
}

impl Place<'_> {
    /// The box.
    #[inline(always)]
    pub(super) fn bounds(&self) -> &Bounds {
        &self.node.bounds
    }

    /// The cluster of a leaf.
    #[inline(always)]
    pub(super) fn cluster(&self) -> Option<usize> {
        (self.node.axis == LEAF).then_some(self.node.link as usize)
    }
}

/// Adds the tree over `order` and returns its box.
fn add(nodes: &mut Vec<Node>, clusters: &[Cluster], order: &mut [u32]) -> Bounds {
    let index = nodes.len();
    if let [cluster] = *order {
        let bounds = Bounds::of(&clusters[cluster as usize]);
        nodes.push(Node { bounds, link: cluster, axis: LEAF, middle: 0.0 });
        return bounds;
    }
    let middle = |cluster: u32, axis: usize| {
        let cluster = &clusters[cluster as usize];
        (cluster.min[axis] + cluster.max[axis]) / 2.0
    };
    let spread = |axis: usize| {
        let middles = || order.iter().map(|&cluster| middle(cluster, axis));
        middles().fold(f32::NEG_INFINITY, f32::max) - middles().fold(f32::INFINITY, f32::min)
    };
    let spreads = [0, 1, 2].map(spread);
    let axis = (0..3).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |&a, &b| middle(a, axis).total_cmp(&middle(b, axis)).then(a.cmp(&b)));
    let parting = middle(order[half], axis);
    nodes.push(Node { bounds: Bounds::EMPTY, link: 0, axis: axis as u8, middle: parting });
    let (low, high) = order.split_at_mut(half);
    let below = add(nodes, clusters, low);
    nodes[index].link = nodes.len() as u32;
    let bounds = below.with(add(nodes, clusters, high));
    nodes[index].bounds = bounds;
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn clusters(middles: &[[f32; 3]]) -> Vec<Cluster> {
        let cluster = |(index, middle): (usize, &[f32; 3])| Cluster {
            triangles: index..index + 1,
            min: middle.map(|value| value - 1.0),
            max: middle.map(|value| value + 1.0),
        };
        middles.iter().enumerate().map(cluster).collect()
    }

    proptest! {
        #[test]
        fn a_walk_that_accepts_what_meets_a_box_finds_the_clusters_that_meet_it(
            middles in prop::collection::vec(proptest::array::uniform3(-50.0_f32..50.0), 0..80),
            eye in proptest::array::uniform3(-60.0_f32..60.0),
            low in proptest::array::uniform3(-50.0_f32..50.0),
        ) {
            let clusters = clusters(&middles);
            let high = low.map(|value| value + 30.0);
            let meets = |min: &[f32; 3], max: &[f32; 3]| (0..3).all(|axis| min[axis] <= high[axis] && max[axis] >= low[axis]);
            let mut found = Vec::new();
            Hierarchy::new(&clusters).walk(eye, &mut Vec::new(), |bounds, cluster| {
                let accepted = meets(&bounds.min, &bounds.max);
                found.extend(cluster.filter(|_| accepted));
                accepted
            });
            found.sort_unstable();
            let expected: Vec<usize> =
                (0..clusters.len()).filter(|&index| meets(&clusters[index].min, &clusters[index].max)).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn clusters_in_a_row_come_from_near_to_far() {
        let clusters = clusters(&[[40.0, 0.0, 0.0], [10.0, 0.0, 0.0], [30.0, 0.0, 0.0], [20.0, 0.0, 0.0]]);
        for (eye, expected) in [(0.0, [1, 3, 2, 0]), (50.0, [0, 2, 3, 1])] {
            let mut found = Vec::new();
            Hierarchy::new(&clusters).walk([eye, 0.0, 0.0], &mut Vec::new(), |_, cluster| {
                found.extend(cluster);
                true
            });
            assert_eq!(found, expected);
        }
    }
}
