//! Which triangles a ray has been told of.

/// The triangles of one ray, where several leaves may hold parts of the same.
#[derive(Default)]
pub struct Told {
    first: [(u32, u32); 8],
    count: usize,
    /// What the first places cannot hold: few rays go through so many surfaces and on.
    more: Vec<(u32, u32)>,
}

impl Told {
    /// Forgets all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
        self.more.clear();
    }

    /// Notes a triangle of an instance; whether it was not known.
    #[inline(always)]
    pub fn is_new(&mut self, instance: u32, triangle: u32) -> bool {
        let new = (instance, triangle);
        let known = self.first.iter().take(self.count).chain(&self.more).any(|&other| other == new);
        if !known {
            match self.first.get_mut(self.count) {
                Some(place) => (*place, self.count) = (new, self.count + 1),
                None => self.more.push(new),
            }
        }
        !known
    }
}
