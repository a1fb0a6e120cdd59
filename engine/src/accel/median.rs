//! A builder that nothing makes slow or deep: halves by the median of the centroids, whatever the boxes are.

use super::build::{Below, BinaryNode, Box3};

/// Builds a tree over at least one box whose depth is the logarithm of their number, its nodes in the order of [`super::build::Draft::finish`].
pub fn build(boxes: &[Box3]) -> Vec<BinaryNode> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![BinaryNode::new(Box3::EMPTY, Below::Leaf(0))];
    let mut work = vec![(0usize, 0..order.len())];
    while let Some((at, range)) = work.pop() {
        let part = &mut order[range.clone()];
        let bounds = part.iter().fold(Box3::EMPTY, |sum, &i| sum.union(boxes[i as usize]));
        if let [only] = *part {
            nodes[at] = BinaryNode::new(bounds, Below::Leaf(only));
            continue;
        }
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, split_order(boxes, part));
        let first = nodes.len();
        nodes[at] = BinaryNode::new(bounds, Below::Pair(first as u32));
        nodes.extend([nodes[at]; 2]);
        work.push((first + 1, range.start + middle..range.end));
        work.push((first, range.start..range.start + middle));
    }
    nodes
}

/// Along the axis on which the centroids spread most; concentric boxes by their size. The index makes the order total.
fn split_order<'a>(boxes: &'a [Box3], part: &[u32]) -> impl Fn(&u32, &u32) -> std::cmp::Ordering + use<'a> {
    let spread = part.iter().fold(Box3::EMPTY, |sum, &i| {
        let centroid = boxes[i as usize].centroid();
        sum.union(Box3 { min: centroid, max: centroid })
    });
    let extent = spread.max - spread.min;
    let axis = extent.max_position();
    let size = part.iter().map(|&i| boxes[i as usize].half_area()).fold(0.0, f32::max);
    let concentric = extent[axis] * extent[axis] < size * 1e-6;
    let key = move |i: u32| {
        let b = &boxes[i as usize];
        if concentric { b.half_area() } else { b.centroid()[axis] }
    };
    move |a, b| key(*a).total_cmp(&key(*b)).then(a.cmp(b))
}
